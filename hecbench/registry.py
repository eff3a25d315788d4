"""Discovery of plugins. Broken, conflicting and not-ready plugins are data to be listed, never crashes.

An entry point of group ``hecbench`` names a module with hooks, or a package whose ``plugin_folders`` names folders of
such modules. Every module is imported inside its own ``try``, so one bad file costs one plugin.
"""

from __future__ import annotations

import pkgutil
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from enum import StrEnum
from functools import cache
from importlib import import_module, metadata
from importlib.util import find_spec
from types import ModuleType
from typing import Any, TypeVar, cast

import pluggy

from hecbench import hookspecs
from hecbench.errors import InputError
from hecbench.specs import AnySpec, ConfigurableSpec, Kind, SolverSpec, Spec

_WITH_OPTIONS = (Kind.SOLVER, Kind.SEGMENTER, Kind.TRANSLATOR)
"""Kinds whose specs are `ConfigurableSpec`."""

hookimpl = pluggy.HookimplMarker(hookspecs.GROUP)

OWN_DISTRIBUTION = "hecbench"

TrialObserver = Callable[..., object]
"""Called as `observer(trial=TrialRecord)`."""

AnySpecT = TypeVar("AnySpecT", bound=Spec)


class PluginStatus(StrEnum):
    """Whether a plugin can be used: `missing` lacks an import, `conflict` shares its name with another."""

    READY = "ready"
    MISSING = "missing"
    BROKEN = "broken"
    CONFLICT = "conflict"


@dataclass(frozen=True)
class Plugin:
    """One listed plugin. `spec` is None when its module could not be loaded; `detail` says why."""

    name: str
    kind: Kind | None
    status: PluginStatus
    distribution: str
    version: str
    detail: str = ""
    spec: AnySpec | None = None

    def row(self) -> dict[str, Any]:
        """The row of ``hecbench plugins --json``."""
        needs = sorted(self.spec.needs) if isinstance(self.spec, SolverSpec) else []
        return {
            "name": self.name,
            "kind": self.kind,
            "status": self.status,
            "needs": needs,
            "detail": self.detail or self._about(),
            "distribution": self.distribution,
            "version": self.version,
        }

    def _about(self) -> str:
        if self.spec is None:
            return ""
        options = self.spec.options if isinstance(self.spec, ConfigurableSpec) else ()
        offered = "".join(f"; [{option.name}=...]: {option.summary}" for option in options)
        return self.spec.summary + offered


@dataclass(frozen=True)
class Registry:
    """All plugins, found once, sorted by kind and name; functions to call after each trial, by their module."""

    plugins: list[Plugin]
    trial_observers: dict[str, TrialObserver] = field(default_factory=dict)

    def select(self, kind: Kind | None = None) -> list[Plugin]:
        """Plugins of one kind or, with the unloadable ones, of all."""
        return [plugin for plugin in self.plugins if kind in (None, plugin.kind)]

    def ready(self, kind: Kind, spec_type: type[AnySpecT]) -> list[AnySpecT]:
        """Specs of one kind that can be used now."""
        specs = [plugin.spec for plugin in self.select(kind) if plugin.status is PluginStatus.READY]
        return [spec for spec in specs if isinstance(spec, spec_type)]

    def is_foreign(self, solver: str) -> bool:
        """Whether the solver of that name, options set in it or not, comes from another distribution than ours."""
        plain, _ = _settings(Kind.SOLVER, solver)
        return any(
            plugin.kind is Kind.SOLVER and plugin.name == plain and plugin.distribution != OWN_DISTRIBUTION
            for plugin in self.plugins
        )

    def get(self, kind: Kind, name: str, spec_type: type[AnySpecT]) -> AnySpecT:
        """The ready spec of that name; otherwise an `InputError` that says why not and what there is.

        The name of a solver, segmenter or translator may set options of it: ``name[option=value,...]``.
        """
        plain, settings = _settings(kind, name) if kind in _WITH_OPTIONS else (name, {})
        found = [plugin for plugin in self.select(kind) if plugin.name == plain]
        if not found:
            names = ", ".join(spec.name for spec in self.ready(kind, spec_type)) or "none"
            hint = meant(plain, names.split(", "))
            raise InputError(f"no {kind} is called '{plain}': choose one of {names}{hint}")
        plugin = found[0]
        if plugin.status is not PluginStatus.READY or not isinstance(plugin.spec, spec_type):
            raise InputError(f"{kind} '{plain}' is {plugin.status}: {plugin.detail}")
        return plugin.spec.configured(settings) if isinstance(plugin.spec, ConfigurableSpec) else plugin.spec

    def named(self, name: str, kind: str | None = None) -> AnySpec:
        """The ready spec of that name, of any kind; an `InputError` when plugins of several kinds have the name."""
        if kind is not None and kind not in list(Kind):
            raise InputError(f"--kind {kind}: choose one of {', '.join(Kind)}")
        plain = name.partition("[")[0]
        kinds = [plugin.kind for plugin in self.plugins if plugin.name == plain and plugin.kind is not None]
        if kind is None and len(set(kinds)) > 1:
            raise InputError(f"'{plain}' is a {' and a '.join(kinds)}: name one with --kind")
        wanted = Kind(kind) if kind is not None else next(iter(kinds), Kind.SOLVER)
        return cast("AnySpec", self.get(wanted, name, Spec))


def _settings(kind: Kind, name: str) -> tuple[str, dict[str, str]]:
    """A plugin's name and the options set in it: ``name[option=value,...]``."""
    plain, bracket, rest = name.partition("[")
    if not bracket:
        return name, {}
    pairs = [setting.partition("=") for setting in rest.removesuffix("]").split(",")]
    if not rest.endswith("]") or not all(option and equals for option, equals, _ in pairs):
        raise InputError(f"{kind} '{name}': write options as {plain or kind}[option=value,option=value]")
    return plain, {option.strip(): value.strip() for option, _, value in pairs}


def meant(word: str, known: Iterable[str]) -> str:
    """ ", did you mean ...?" where something known is spelled nearly alike, else nothing."""
    near = get_close_matches(word.lower(), list(known), n=2)
    return f"; did you mean {' or '.join(near)}?" if near else ""


@cache
def load() -> Registry:
    """Find every installed plugin, ours and strangers'."""
    return build(metadata.entry_points(group=hookspecs.GROUP))


def build(entry_points: Iterable[metadata.EntryPoint]) -> Registry:
    """Load the given entry points one by one and collect their specs."""
    observers: dict[str, TrialObserver] = {}
    plugins = [
        plugin
        for entry_point in sorted(entry_points, key=lambda e: (e.name, e.value))
        for plugin in _plugins_of(entry_point, observers)
    ]
    listed = sorted(_refuse_shared_names(plugins), key=lambda p: (p.kind or "", p.name))
    return Registry(listed, observers)


def _plugins_of(entry_point: metadata.EntryPoint, observers: dict[str, TrialObserver]) -> Iterator[Plugin]:
    distribution = entry_point.dist.name if entry_point.dist else "unknown"
    version = entry_point.dist.version if entry_point.dist else "unknown"

    def broken(name: str, error: BaseException) -> Plugin:
        detail = f"{type(error).__name__}: {error}".splitlines()[0]
        return Plugin(name, None, PluginStatus.BROKEN, distribution, version, detail)

    try:
        target = entry_point.load()
    except Exception as error:  # a stranger's module may raise anything at import
        yield broken(entry_point.name, error)
        return
    for module_name in _module_names(target):
        try:
            specs, observer = _implemented(import_module(module_name))
        except Exception as error:  # likewise
            yield broken(module_name, error)
            continue
        if observer is not None:
            observers[module_name] = observer
        for spec in specs:
            status, detail = _readiness(spec)
            yield Plugin(spec.name, spec.kind, status, distribution, version, detail, spec)


def _module_names(target: ModuleType) -> Iterator[str]:
    """The modules with hooks: those of `plugin_folders` ("." is the package itself), or the target alone."""
    folders = getattr(target, "plugin_folders", None)
    if folders is None:
        yield target.__name__
        return
    for folder in folders:
        package = target if folder == "." else import_module(f"{target.__name__}.{folder}")
        found = pkgutil.iter_modules(package.__path__, prefix=f"{package.__name__}.")
        yield from (module.name for module in found if not module.ispkg)


def _implemented(module: ModuleType) -> tuple[list[AnySpec], TrialObserver | None]:
    """Everything that the hooks of one module yield, and its observer of trials; a misspelt hook raises instead of
    being ignored.
    """
    manager = pluggy.PluginManager(hookspecs.GROUP)
    manager.add_hookspecs(hookspecs)
    manager.register(module)
    manager.check_pending()
    hooks = {hook.name: hook for hook in manager.get_hookcallers(module) or []}
    observer = hooks.pop(hookspecs.hecbench_trial_finished.__name__, None)
    specs = [spec for hook in hooks.values() for yielded in hook() for spec in yielded]
    for spec in specs:
        if not isinstance(spec, Spec):
            raise TypeError(f"a hook yielded {spec!r}, expected a spec of hecbench.specs")
    return specs, observer


def _readiness(spec: Spec) -> tuple[PluginStatus, str]:
    absent = [name for name in spec.imports if find_spec(name.partition(".")[0]) is None]
    if absent:
        return PluginStatus.MISSING, f"needs {', '.join(absent)}, not installed: see `hecbench doctor`"
    return PluginStatus.READY, ""


def _refuse_shared_names(plugins: list[Plugin]) -> list[Plugin]:
    """Mark every plugin whose kind and name another one claims too: neither is used until one goes."""
    claims = Counter((plugin.kind, plugin.name) for plugin in plugins if plugin.spec)

    def checked(plugin: Plugin) -> Plugin:
        if plugin.spec is None or claims[plugin.kind, plugin.name] == 1:
            return plugin
        claimants = sorted(p.distribution for p in plugins if (p.kind, p.name) == (plugin.kind, plugin.name))
        detail = f"the name is claimed by {' and '.join(claimants)}: uninstall or rename one"
        return replace(plugin, status=PluginStatus.CONFLICT, detail=detail)

    return [checked(plugin) for plugin in plugins]
