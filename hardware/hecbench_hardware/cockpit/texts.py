"""What the page says, as Markdown and HTML."""

from __future__ import annotations

import html
import re

from hecbench.verdict import Verdict
from hecbench_hardware.cockpit.coverage import Coverage
from hecbench_hardware.cockpit.session import FEWEST, Now

_CELL = '<td style="width:2.2em;height:1.6em;border:1px solid #999;background:{}"></td>'
_FILLED, _EMPTY = "#147a3c", "transparent"
_MARKUP = re.compile(r"([\\`*_{}\[\]<>#|])")


def plain(text: object) -> str:
    """Text that Markdown shows as it is."""
    return _MARKUP.sub(r"\\\1", str(text))


def fault(error: Exception) -> str:
    """What went wrong."""
    return f"**{plain(error)}**"


def now(seen: Now, has_target: bool) -> str:
    """The robot's and the target's state."""
    robot = "the robot's pose is not known" if seen.state is None else "the robot stands still"
    if seen.state is not None and not seen.still:
        robot = "the robot moves"
    if not has_target:
        return robot
    return f"{robot}; the target is {'seen' if seen.seen else '**not seen**'}"


def next_pose(words: str | None) -> str:
    """The next pose in words."""
    if words is None:
        return "Next: take a first sample with the target, or the robot, well in view"
    return f"Next (blue): {plain(words)}"


def coverage(covered: Coverage) -> str:
    """The parts of the picture as a table, and sentences."""
    lines = "".join(f"<li>{html.escape(line)}</li>" for line in covered.lines())
    table = ""
    if covered.with_target is not None:
        rows = (
            "<tr>" + "".join(_CELL.format(_FILLED if part else _EMPTY) for part in row) + "</tr>"
            for row in covered.parts
        )
        table = f'<table style="border-collapse:collapse">{"".join(rows)}</table>'
    return f'<div id="coverage" style="padding:0.4em 1em">{table}<ul style="padding-left:1.2em">{lines}</ul></div>'


def verdict(found: Verdict | None, samples: int) -> str:
    """The answer, what to expect of it and why."""
    if found is None:
        return f"a verdict comes with {FEWEST} samples; there are {samples}"
    said = [f"### {found.grade.words} ({samples} samples)", plain(found.rule)]
    best = found.recommended
    if best is not None:
        x, y, z = best.pose[:3, 3]
        said.append(
            f"**{plain(best.solver)}**: camera at x {x:.4f}, y {y:.4f}, z {z:.4f} m of the {best.parent_link}"
        )
    if found.expected is not None:
        said.append(f"expected error in the workspace: **{found.expected}** (95 %)")
    for title, sentences in (("Why", found.reasons), ("Next", found.next)):
        if sentences:
            said.append(f"{title}:\n\n" + "\n".join(f"- {plain(sentence)}" for sentence in sentences))
    return "\n\n".join(said)
