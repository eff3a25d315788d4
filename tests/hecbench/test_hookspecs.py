"""The docstring of every hook holds a whole plugin that works."""

import inspect
import re
import sys
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest

from hecbench import conformance, hookspecs, registry
from hecbench.recording import Mounting
from hecbench.specs import DeviceSpec, Kind, ObserverSpec, SegmenterSpec, SuiteSpec

HOOKS = [name for name, value in vars(hookspecs).items() if name.startswith("hecbench_") and callable(value)]


def code(hook):
    return re.search(r"```python\n(.*?)```", inspect.getdoc(getattr(hookspecs, hook)), re.S)[1]


@pytest.fixture
def listed(monkeypatch):
    """The registry of the plugin that a docstring holds, as if it were installed."""

    def build(hook):
        module = ModuleType(f"docstring_of_{hook}")
        exec(compile(code(hook), module.__name__, "exec"), vars(module))
        monkeypatch.setitem(sys.modules, module.__name__, module)
        return registry.build([SimpleNamespace(name=hook, value=hook, dist=None, load=lambda: module)])

    return build


@pytest.fixture
def installed(listed):
    def install(hook):
        (found,) = listed(hook).plugins
        assert found.status is registry.PluginStatus.READY, found.detail
        return found.spec

    return install


@pytest.mark.parametrize("hook", HOOKS)
def test_every_docstring_holds_a_plugin_that_loads(listed, hook):
    found = listed(hook)
    assert found.plugins or found.trial_observers


@pytest.mark.parametrize(
    "hook",
    ["hecbench_solvers", "hecbench_datasets", "hecbench_evaluators", "hecbench_exporters", "hecbench_segmenters",
     "hecbench_translators"],
)  # fmt: skip
def test_plugins_conform(installed, hook):
    checks = conformance.check_plugin(installed(hook))
    assert checks
    assert [f"{check.name}: {check.detail}" for check in checks if not check.passed] == []


def test_a_solver_is_short():
    assert len([line for line in code("hecbench_solvers").splitlines() if line.strip()]) <= 30


def test_an_adapter_is_short():
    assert len([line for line in code("hecbench_datasets").splitlines() if line.strip()]) <= 60


def test_the_adapter_reads_what_it_recognises(installed, tmp_path, rng):
    spec = installed("hecbench_datasets")
    rig = conformance.rig(rng, Mounting.EYE_TO_HAND)
    np.savez(tmp_path / "poses.npz", base_T_flange=rig.base_T_flange, camera_T_target=rig.camera_T_target)
    assert spec.sniff(tmp_path)
    np.testing.assert_allclose(spec.load(tmp_path).camera_T_target, rig.camera_T_target)


def test_the_suite_can_be_solved(installed):
    spec: SuiteSpec = installed("hecbench_suites")
    recording = spec.make("exact", 0, 0)
    found = registry.load().named("park").factory()(recording.without_truth(), rng=np.random.default_rng(0))
    np.testing.assert_allclose(found.parent_T_camera, recording.truth_parent_T_camera, atol=1e-9)


def test_the_observer_applies_where_it_should(installed, rng):
    spec: ObserverSpec = installed("hecbench_observers")
    assert not spec.applies(conformance.rig(rng, Mounting.EYE_TO_HAND))


def test_the_segmenter_finds_what_moves(installed):
    from hecbench.conformance.photographs import photographs

    spec: SegmenterSpec = installed("hecbench_segmenters")
    found = spec.factory()(photographs().without_truth())
    assert found.mask(0).any()


@pytest.mark.parametrize(("hook", "kind"), [("grippers", Kind.GRIPPER), ("cameras", Kind.CAMERA)])
def test_devices_open(installed, hook, kind):
    spec: DeviceSpec = installed(f"hecbench_{hook}")
    device = spec.open({})
    assert (spec.kind, spec.simulated) == (kind, True)
    if kind is Kind.GRIPPER:
        device.enable()
        assert device.close_fingers().holding
    else:
        assert device.grab().image.shape == (480, 640, 3)
    device.close()


def test_the_robot_is_listed(installed):
    assert installed("hecbench_robots").simulated


def test_the_observer_of_trials_is_called(listed, caplog):
    (observe,) = listed("hecbench_trial_finished").trial_observers.values()
    observe(trial=SimpleNamespace(task="grasp", place=3, outcome="success"))
    assert "grasp at place 3: success" in caplog.text
