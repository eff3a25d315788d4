"""Plugins: ours are found, strangers' faults are data."""

import sys
from importlib import metadata

import pytest

from hecbench import registry
from hecbench.errors import InputError
from hecbench.registry import PluginStatus
from hecbench.specs import Kind, SolverSpec

GOOD = """
from hecbench.registry import hookimpl
from hecbench.specs import Need, SolverSpec

@hookimpl
def hecbench_solvers():
    yield SolverSpec(name="{name}", summary="s", factory=lambda: None, needs=frozenset({{Need.CORNERS}}),
                     imports={imports}, reference="r")
"""

CONFIGURABLE = """
from hecbench.registry import hookimpl
from hecbench.specs import Option, SolverSpec

@hookimpl
def hecbench_solvers():
    yield SolverSpec(name="third", summary="s", factory=lambda rounds=1, weight=0.5: (rounds, weight),
                     needs=frozenset(), reference="r",
                     options=(Option("rounds", int, "how often"), Option("weight", float, "of it")))
"""

OBSERVER = """
from hecbench.registry import hookimpl

seen = []

@hookimpl
def hecbench_trial_finished({argument}):
    seen.append({argument})
"""


@pytest.fixture
def entry_point(tmp_path, monkeypatch):
    monkeypatch.syspath_prepend(tmp_path)

    def make(module, source):
        (tmp_path / f"{module}.py").write_text(source)
        monkeypatch.delitem(sys.modules, module, raising=False)
        return metadata.EntryPoint(module, module, "hecbench")

    return make


def found(*entry_points):
    return {(p.name, p.status): p for p in registry.build(entry_points).plugins}


def test_our_own_solvers_are_ready():
    ready = {spec.name for spec in registry.load().ready(Kind.SOLVER, SolverSpec)}
    assert {"tsai", "park", "horaud", "andreff", "daniilidis", "shah", "li"} <= ready
    assert not [
        p for p in registry.load().plugins if p.status in (PluginStatus.BROKEN, PluginStatus.CONFLICT)
    ]


def test_a_good_stranger_is_ready(entry_point):
    plugins = found(entry_point("third_good", GOOD.format(name="third", imports="()")))
    assert plugins["third", "ready"].row()["needs"] == ["corners"]


@pytest.mark.parametrize(
    ("source", "detail"),
    [
        ("raise RuntimeError('no licence')", "RuntimeError: no licence"),
        ("def broken(:", "SyntaxError"),
        ("import a_module_that_is_nowhere", "ModuleNotFoundError"),
        (
            GOOD.format(name="x", imports="()").replace("hecbench_solvers", "hecbench_slovers"),
            "hecbench_slovers",
        ),
        (GOOD.format(name="x", imports="()").replace("yield SolverSpec(", "yield dict("), "expected a spec"),
        (GOOD.format(name="x", imports="()").replace("yield", "1 / 0; yield"), "ZeroDivisionError"),
        (GOOD.format(name="x", imports="()").replace("reference=", "refrence="), "TypeError"),
    ],
)
def test_a_broken_stranger_is_listed_and_harms_nobody(entry_point, source, detail):
    broken = entry_point("third_broken", source)
    good = entry_point("third_fine", GOOD.format(name="fine", imports="()"))
    plugins = found(broken, good)
    assert ("fine", "ready") in plugins
    assert detail in plugins["third_broken", "broken"].detail


def test_a_missing_import_is_not_broken(entry_point):
    plugins = found(entry_point("third_missing", GOOD.format(name="third", imports='("a_module_nowhere",)')))
    assert "a_module_nowhere" in plugins["third", "missing"].detail


def test_two_claims_on_one_name_are_refused(entry_point):
    first = entry_point("third_one", GOOD.format(name="same", imports="()"))
    second = entry_point("third_two", GOOD.format(name="same", imports="()"))
    found_registry = registry.build([first, second])
    assert [p.status for p in found_registry.plugins] == [PluginStatus.CONFLICT] * 2
    with pytest.raises(InputError, match="'same' is conflict: the name is claimed by"):
        found_registry.get(Kind.SOLVER, "same", SolverSpec)


def test_unknown_names_are_answered_with_the_known_ones():
    with pytest.raises(InputError, match=r"no solver is called 'tasi': choose one of .*tsai"):
        registry.load().get(Kind.SOLVER, "tasi", SolverSpec)


def test_an_observer_of_trials_is_found_and_not_listed(entry_point):
    found = registry.build([entry_point("third_observer", OBSERVER.format(argument="trial"))])
    assert found.plugins == []
    found.trial_observers["third_observer"](trial="a trial")
    assert sys.modules["third_observer"].seen == ["a trial"]


def test_a_misspelt_argument_of_an_observer_is_broken(entry_point):
    found = registry.build([entry_point("third_misspelt", OBSERVER.format(argument="trail"))])
    assert [plugin.status for plugin in found.plugins] == ["broken"]
    assert found.trial_observers == {}


def test_options_in_a_solvers_name_reach_its_factory(entry_point):
    plugins = registry.build([entry_point("third_options", CONFIGURABLE)])
    spec = plugins.get(Kind.SOLVER, "third[weight=2, rounds=3]", SolverSpec)
    assert spec.factory() == (3, 2.0)
    assert spec.name == "third[rounds=3,weight=2]"
    assert plugins.get(Kind.SOLVER, "third", SolverSpec).factory() == (1, 0.5)
    assert "rounds=" in plugins.select()[0].row()["detail"]


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("third[speed=1]", "has no option 'speed'"),
        ("third[rounds=many]", "rounds=many is not understood"),
        ("third[rounds]", r"write options as third\[option=value"),
        ("third[rounds=1", "write options"),
        ("fourth[rounds=1]", "no solver is called 'fourth'"),
    ],
)
def test_wrong_options_are_refused_with_the_cure(entry_point, name, said):
    plugins = registry.build([entry_point("third_options", CONFIGURABLE)])
    with pytest.raises(InputError, match=said):
        plugins.get(Kind.SOLVER, name, SolverSpec)
