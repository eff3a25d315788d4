"""The verb `robot`: how a robot's file is read."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from hecbench.commands import choices, console
from hecbench.errors import InputError
from hecbench.system.wording import significant

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from hecbench.robots.model import RobotModel

_WIDTH, _HEIGHT, _FOCAL_PX = 960, 720, 1100.0
_AMBIENT = 0.35


@click.command()
@click.argument("source", metavar="FILE-or-NAME")
@click.option(
    "--joints", metavar="Q,...", help="Positions of the joints, rad or m; default: zero, within the limits."
)
@click.option("--picture", type=choices.FILE, metavar="OUT.png", help="Draw the robot as it was read.")
@choices.as_json
def robot(source: str, joints: str | None, picture: Path | None, as_json: bool) -> None:
    """Show how a robot is read: its links, joints, meshes, colours, and what is missing.

    FILE-or-NAME is a URDF, a name that `hecbench plugins --kind robot` lists, or PACKAGE:PATH of an installed package.
    """
    from hecbench.robots.extent import resting
    from hecbench.robots.model import load_robot

    if picture is not None and picture.suffix.lower() != ".png":
        raise InputError(f"--picture {picture}: only PNG is written: name it .png")
    model = load_robot(source)
    positions = resting(model) if joints is None else model.check(_numbers(joints))
    found = describe(model, positions)
    if picture is not None:
        _draw(model, positions, picture)
    if as_json:
        console.print_json(found)
        return
    size = " x ".join(f"{side:.3f}" for side in found["extent_m"])
    click.echo(
        f"{model.name}: {found['links']} links, {len(model.joint_names)} joints that move, {found['parts']} parts"
        f" with {found['faces']} faces in {found['colours']} colours, {size} m"
    )
    for joint in found["joints"]:
        if joint["type"] != "fixed":
            follows = f", follows {joint['mimic']}" if joint["mimic"] else ""
            limits = ""
            if joint["lower"] is not None:
                limits = f" {significant(joint['lower'], 4)} to {significant(joint['upper'], 4)}"
            click.echo(f"  {joint['name']}: {joint['type']}{limits}{follows}")
    for note in found["notes"]:
        click.echo(f"  note: {note}")


def describe(model: RobotModel, positions: NDArray[np.float64]) -> dict[str, Any]:
    """What the verb prints with --json."""
    import numpy as np

    from hecbench.robots.extent import oversized, placed

    points = placed(model, positions)
    return {
        "name": model.name,
        "links": len(model.links),
        "joints": [
            {
                "name": joint.name,
                "type": joint.kind,
                "lower": joint.lower if np.isfinite(joint.lower) else None,
                "upper": joint.upper if np.isfinite(joint.upper) else None,
                "mimic": joint.leader,
            }
            for joint in model.joints
        ],
        "parts": len(model.parts),
        "faces": sum(len(part.faces) for part in model.parts),
        "extent_m": np.ptp(points, axis=0).tolist() if len(points) else [0.0, 0.0, 0.0],
        "colours": len({part.colour for part in model.parts}),
        "notes": [*model.notes, *model.beyond(positions), *oversized(model)],
    }


def _numbers(text: str) -> list[float]:
    try:
        return [float(word) for word in text.replace(",", " ").split()]
    except ValueError:
        raise InputError(f"--joints {text}: give numbers separated by commas, rad or m") from None


def _draw(model: RobotModel, positions: NDArray[np.float64], path: Path) -> None:
    """The robot from its front, left and above, lit from the camera."""
    import numpy as np

    from hecbench import se3
    from hecbench.rendering import Renderer, RenderMesh
    from hecbench.robots.extent import placed
    from hecbench.system import files
    from hecbench.system.pictures import encode_png

    mesh = RenderMesh.of(model)
    points = placed(model, positions)
    middle = (points.min(0) + points.max(0)) / 2
    size = float(np.linalg.norm(np.ptp(points, axis=0)))
    ahead = np.array([-1.0, -0.7, -0.5]) / np.linalg.norm([1.0, 0.7, 0.5])
    right = np.cross(ahead, [0, 0, 1.0])
    right /= np.linalg.norm(right)
    eye = middle - ahead * size * _FOCAL_PX / _HEIGHT
    camera_T_root = se3.inverse(se3.make(np.stack([right, np.cross(ahead, right), ahead], 1), eye))
    K = np.array([[_FOCAL_PX, 0, _WIDTH / 2 - 0.5], [0, _FOCAL_PX, _HEIGHT / 2 - 0.5], [0, 0, 1.0]])
    renderer = Renderer(mesh, K, _WIDTH, _HEIGHT, ambient=_AMBIENT)
    renderer.draw(camera_T_root @ model.link_poses(positions))
    image = renderer.image(background=(1.0, 1.0, 1.0))[..., :3]
    files.write_bytes(path, encode_png(np.round(255 * np.clip(image, 0, 1)).astype(np.uint8)))
