"""The group that plugins register in, and the marker of its hooks."""

from __future__ import annotations

import pluggy

GROUP = "hecbench"
"""The entry-point group and the prefix of every hook."""

hookspec = pluggy.HookspecMarker(GROUP)
