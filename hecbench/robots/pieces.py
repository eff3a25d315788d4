"""Triangles of one mesh file by material: what every format is read into."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hecbench.errors import InputError
from hecbench.robots import materials
from hecbench.robots.materials import Colour, Material


@dataclass(frozen=True, eq=False)
class Piece:
    """Triangles of one material. `colour` is None where the file gives none."""

    name: str
    vertices: NDArray[np.float64]
    """(V, 3) m, in the file's frame."""
    faces: NDArray[np.int64]
    colour: Colour | None


def checked(path: Path, expected: int, pieces: list[Piece]) -> list[Piece]:
    """The pieces; an `InputError` where they are not all faces that the file declares."""
    found = sum(len(piece.faces) for piece in pieces)
    if found != expected:
        raise InputError(
            f"{path}: {found} of its {expected} faces could be read: export it again as triangles"
        )
    return pieces


def piece(
    name: str, vertices: Any, faces: Any, material: Material, uv: Any, path: Path, notes: list[str]
) -> Piece:
    """Triangles without unused vertices, in the colour of their material or the mean of its texture."""
    vertices, faces = np.asarray(vertices, float), np.asarray(faces, np.int64).reshape(-1, 3)
    used, faces = np.unique(faces, return_inverse=True)
    faces = faces.reshape(-1, 3)
    vertices, uv = vertices[used], None if uv is None else np.asarray(uv, float)[used]
    colour = material.colour
    if material.texture is not None:
        mean, fault = materials.textured(material.texture, uv, faces, vertices)
        if mean is not None:
            red, green, blue = (float(value) for value in np.multiply(mean, material.tint))
            colour = red, green, blue
        if fault is not None:
            notes.append(f"mesh {path.name}: material {name} has lost its texture: {fault}")
    return Piece(name, vertices, faces, colour)


def labelled(pieces: list[Piece]) -> list[Piece]:
    """Names made unique with their place."""
    seen: set[str] = set()
    named: list[Piece] = []
    for piece in pieces:
        name = piece.name if piece.name not in seen else f"{piece.name}.{len(named)}"
        seen.add(name)
        named.append(Piece(name, piece.vertices, piece.faces, piece.colour))
    return named
