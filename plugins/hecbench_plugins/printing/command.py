"""The verb ``hecbench target``."""

from __future__ import annotations

import re
from pathlib import Path

import click

from hecbench.errors import InputError

_KINDS = ("chessboard", "charuco", "apriltag", "circles", "aruco", "aruco_grid", "aprilgrid")


@click.command()
@click.argument("kind", type=click.Choice([*_KINDS]))
@click.option(
    "--size", "size_mm", type=float, required=True, metavar="MM",
    help="Of a square, of the black border of a tag, or between the centres of dots.",
)  # fmt: skip
@click.option(
    "--grid", metavar="COLUMNSxROWS", help="Inner corners (chessboard), squares (charuco), dots or markers."
)
@click.option(
    "--marker", "marker_mm", type=float, metavar="MM", help="Of a ChArUco marker; default: 3/4 of --size."
)
@click.option(
    "--gap",
    "gap_mm",
    type=float,
    metavar="MM",
    help="White between two markers of a grid; default: 3/10 of --size.",
)
@click.option("--dictionary", default="4X4_50", show_default=True, help="Of ArUco markers.")
@click.option("--family", default="tag36h11", show_default=True, help="Of AprilTags.")
@click.option("--id", "tag_id", default=0, show_default=True, help="Of a marker, or of the first of a grid.")
@click.option("--paper", default="A4", show_default=True, help="A0 to A5, letter or legal.")
@click.option(
    "--out", type=click.Path(path_type=Path, dir_okay=False), help="PDF, SVG or PNG; default: KIND.pdf"
)
def target(
    kind: str,
    size_mm: float,
    grid: str | None,
    marker_mm: float | None,
    gap_mm: float | None,
    dictionary: str,
    family: str,
    tag_id: int,
    paper: str,
    out: Path | None,
) -> None:
    """Write a target to print, to scale, and print the JSON that a recording describes it by."""
    import msgspec
    import numpy as np

    from hecbench import targets
    from hecbench.storage.recording_io import target_json
    from hecbench_plugins.printing import page

    if not 0 < size_mm < 2000:
        raise InputError(f"--size {size_mm}: give millimetres, more than 0 and less than 2000")
    gap_m = (0.3 * size_mm if gap_mm is None else gap_mm) / 1e3
    if kind == "apriltag":
        made: targets.Target = targets.AprilTagTarget(family, tag_id, size_mm / 1e3)
    elif kind == "aruco":
        made = targets.ArucoTarget(dictionary, tag_id, size_mm / 1e3)
    else:
        columns, rows = _grid(kind, grid)
        if kind == "chessboard":
            made = targets.ChessboardTarget(columns, rows, size_mm / 1e3)
        elif kind == "charuco":
            marker_m = (0.75 * size_mm if marker_mm is None else marker_mm) / 1e3
            made = targets.CharucoTarget(columns, rows, size_mm / 1e3, marker_m, dictionary)
        elif kind == "aruco_grid":
            made = targets.ArucoGridTarget(columns, rows, size_mm / 1e3, gap_m, dictionary, tag_id)
        elif kind == "aprilgrid":
            made = targets.AprilGridTarget(
                columns, rows, size_mm / 1e3, 1e3 * gap_m / size_mm, family, tag_id
            )
        else:
            y, x = np.mgrid[:rows, :columns] * size_mm / 1e3
            made = targets.PointsTarget.of(np.stack([x, y, np.zeros_like(x)], -1).reshape(-1, 3))
    path = out or Path(f"{kind}.pdf")
    page.write(made, paper, path)
    click.echo(msgspec.json.format(msgspec.json.encode(target_json(made)), indent=1))
    click.echo(f"{path}: print at 100 % and measure the ruler", err=True)


def _grid(kind: str, text: str | None) -> tuple[int, int]:
    found = re.fullmatch(r"(\d+)x(\d+)", text or "")
    if found is None:
        raise InputError(f"--grid {text}: give a {kind} as COLUMNSxROWS, as in 9x6")
    return int(found[1]), int(found[2])
