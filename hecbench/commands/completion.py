"""Names of plugins for the shell's completion."""

from __future__ import annotations

from collections.abc import Callable

from click import Context, Parameter
from click.shell_completion import CompletionItem

Complete = Callable[[Context, Parameter, str], list[CompletionItem]]


def plugins(*kinds: str, and_files: bool = False) -> Complete:
    """Completes the names of the plugins of these kinds, or of all, that can be used, and what they do.

    Args:
        kinds: of `hecbench.specs.Kind`.
        and_files: complete paths too.
    """

    def complete(context: Context, parameter: Parameter, incomplete: str) -> list[CompletionItem]:
        from hecbench.registry import PluginStatus, load

        paths = [CompletionItem(incomplete, type="file")] if and_files else []
        return paths + [  # click's script for bash drops what comes before paths
            CompletionItem(plugin.name, help=plugin.row()["detail"])
            for plugin in load().plugins
            if plugin.status is PluginStatus.READY
            and (not kinds or plugin.kind in kinds)
            and plugin.name.startswith(incomplete)
        ]

    return complete
