"""`hecbench new` writes a package that passes its checks."""

import sys
from types import SimpleNamespace

import pytest
from click.testing import CliRunner

from hecbench import conformance, registry
from hecbench.commands.new import _KINDS, new
from hecbench.errors import InputError


@pytest.mark.parametrize("kind", _KINDS)
def test_the_package_loads_under_its_name_and_conforms(kind, tmp_path, monkeypatch):
    name = f"my_{kind}"
    done = CliRunner().invoke(new, [kind, name, "--out", str(tmp_path / "package")])
    assert done.exit_code == 0, done.output
    assert f'{name} = "{name}"' in (tmp_path / "package" / "pyproject.toml").read_text()
    monkeypatch.syspath_prepend(tmp_path / "package")
    try:
        module = __import__(name)
        entry = SimpleNamespace(name=name, value=name, dist=None, load=lambda: module)
        (plugin,) = registry.build([entry]).plugins
        assert (plugin.name, plugin.status) == (name, registry.PluginStatus.READY)
        if kind not in ("suite", "observer"):
            assert all(check.passed for check in conformance.check_plugin(plugin.spec))
    finally:
        sys.modules.pop(name, None)


@pytest.mark.parametrize(("name", "message"), [("My-Solver", "lower-case"), ("mine", "exists already")])
def test_bad_names_and_folders_are_refused(name, message, tmp_path):
    done = CliRunner().invoke(new, ["solver", name, "--out", str(tmp_path)])
    assert isinstance(done.exception, InputError)
    assert message in str(done.exception)
