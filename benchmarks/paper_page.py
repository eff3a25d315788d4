"""Write docs/paper.md, the paper's claims beside ours, from the figures in docs/data.

Run: ``python benchmarks/paper_page.py``.
"""

import json
from pathlib import Path

from paper_campaigns import sections

from hecbench.report import paper

DOCS = Path(__file__).resolve().parents[1] / "docs"
COLUMNS = ("MSE", "MAE", "IoU", "PSNR", "SSIM")
LARGER_IS_BETTER = (False, False, True, True, True)
GROUP = "lit"

HEAD = """# The paper's claims

This page is written by `python benchmarks/paper_page.py` from [`data/campaigns.json`](data/campaigns.json) and
[`data/translation.json`](data/translation.json), which hold the command, commit and date of their figures. The
first-order methods of Table I and Tables VI to VIII stand in [first-order methods](first-order.md) and
[studies](studies.md), Table V in [trials](trials.md). Table II cannot be compared on its own set: the Baxter recordings
are not public.

Brackets hold 95 % intervals: of means and medians by the bootstrap, of rates by Wilson. For Tables III and IX the
paper's numbers are of its own photographs; ours are of pictures of a UR5e drawn with lamps, shadows and clutter
(`lit_ur5e_1_*`), cut out by their masks.
"""


def cells(values):
    return " | ".join(str(round(value, 4)) for value in values)


def ours(figures, scale=1.0):
    """Means with their intervals; MSE and MAE divided by powers of `scale`."""
    found = []
    for place, name in enumerate(("mse", "mae", "iou", "psnr", "ssim")):
        by = scale ** (2 - place) if place < 2 else 1.0
        value, low, high = (number / by for number in figures[name])
        found.append(f"{value:.4g} [{low:.4g}, {high:.4g}]")
    return " | ".join(found)


def apart(first, second, larger):
    """Whether the interval of the first (value, low, high) lies on the better side of the second's."""
    return first[1] > second[2] if larger else first[2] < second[1]


def table(lines):
    head = f"| translator | whose | n | {' | '.join(COLUMNS)} |"
    return [head, "|" + "---|" * (3 + len(COLUMNS)), *lines, ""]


def table_three(found, steps):
    lines = []
    for name, values in paper.TABLE_THREE.items():
        lines.append(f"| `{name}` | paper | not said | {cells(values)} |")
        if name in found:
            lines.append(f"| | ours, {steps.get(name, '')} | {found[name]['n']} | {ours(found[name])} |")
    for name in ("learned", "part_colours", "identity"):
        if name in found:
            lines.append(f"| `{name}` | ours | {found[name]['n']} | {ours(found[name])} |")
    trained = [name for name in paper.TABLE_THREE if name in found]
    verdict = "No translator of the paper was trained here; the four cannot be compared."
    if trained and "learned" in found:
        columns = ("mse", "mae", "iou", "psnr", "ssim")
        better = [
            title
            for title, column, larger in zip(COLUMNS, columns, LARGER_IS_BETTER, strict=True)
            if all(apart(found["learned"][column], found[name][column], larger) for name in trained)
        ]
        verdict = (
            f"`learned` is better than all {len(trained)} trained translators, its interval apart from theirs, in"
            f" {', '.join(better) or 'nothing'}; elsewhere the intervals overlap. The"
            " translators were trained at 64 px for a fraction of the paper's 588,000 steps on 256 px, so their rows"
            " say nothing of the methods at full size: cannot be compared."
        )
    return ["## Table III: image-to-image translation", "", *table(lines), verdict, ""]


def table_nine(found):
    lines = [f"| {name} | paper | not said | {cells(values)} |" for name, values in paper.TABLE_NINE.items()]
    for name in ("identity", "part_colours", "learned"):
        if name in found:
            label = "without" if name == "identity" else f"with `{name}`"
            lines.append(f"| {label} | ours | {found[name]['n']} | {ours(found[name], 255.0)} |")
    verdict = ""
    if {"identity", "learned"} <= set(found):
        agrees = found["learned"]["mse"][2] < found["identity"]["mse"][1]
        verdict = f"Translation brings pictures nearer to drawn ones: {'agrees' if agrees else 'not confirmed'} (MSE)."
    return [
        "## Table IX: with and without translation",
        "",
        "MSE and MAE of 1.",
        "",
        *table(lines),
        verdict,
        "",
    ]


def main():
    data = json.loads((DOCS / "data" / "translation.json").read_text())
    found = {key.partition(", ")[2]: value for key, value in data.items() if key.startswith(f"{GROUP}, ")}
    steps = {name: value.get("trained", "") for name, value in found.items()}
    campaigns = json.loads((DOCS / "data" / "campaigns.json").read_text())
    lines = [HEAD, *sections(campaigns), *table_three(found, steps), *table_nine(found)]
    (DOCS / "paper.md").write_text("\n".join(lines).rstrip() + "\n")


if __name__ == "__main__":
    main()
