"""Coloured visual meshes of a URDF's links, parsed once and kept under the hash of everything they were made from."""

from __future__ import annotations

import hashlib
import io
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hecbench.robots import materials, mesh_files
from hecbench.robots.pieces import Piece
from hecbench.robots.references import referenced_files
from hecbench.robots.urdf import Mesh, Primitive, Visual
from hecbench.robots.urdf_files import find_mesh, find_texture
from hecbench.system.cache import Cache

_KEPT = Cache("robots.sqlite", most_bytes=256 * 2**20)
_GREY = (0.7, 0.7, 0.7)
_SAME_M = 1e-6
"""Vertices this close are one."""


@dataclass(frozen=True, eq=False)
class Part:
    """Triangles of one link in one colour. `name` is ``link/material``."""

    name: str
    link: str
    colour: tuple[float, float, float]
    """RGB in [0, 1]."""
    vertices: NDArray[np.float64] = field(repr=False)
    """(V, 3) m in the link frame."""
    faces: NDArray[np.int32] = field(repr=False)
    """(F, 3), counter-clockwise seen from outside."""
    both_sides: NDArray[np.bool_] = field(repr=False, default_factory=lambda: np.zeros(0, bool))
    """(F,) whose back is seen as well, as in surfaces that do not close; empty: none."""
    source: str = ""
    """Name of the mesh file; empty for a box, cylinder or sphere."""


def visual_parts(visuals: Sequence[Visual], urdf: Path) -> tuple[tuple[Part, ...], tuple[str, ...]]:
    """All visual parts and the notes on them, from the cache when nothing changed.

    The colours of a mesh file stand where it has at least two different ones, or where the URDF gives none;
    else the URDF's colour counts, which often is a placeholder for a whole link.

    Raises:
        InputError: a mesh file is missing, unreadable or without faces; the message names it.
    """
    found = {
        visual.shape.filename: find_mesh(visual.shape.filename, urdf)
        for visual in visuals
        if isinstance(visual.shape, Mesh)
    }
    textures = {visual.texture: find_texture(visual.texture, urdf) for visual in visuals if visual.texture}
    key = _digest(urdf, {*found.values(), *filter(None, textures.values())})
    if (kept := _KEPT.get(key)) is not None:
        return _unpacked(kept)
    notes: list[str] = []
    pieces = [_pieces(visual, found, textures, notes) for visual in visuals]
    parts = _seen_from_both_sides(tuple(part for visual in pieces for part in visual))
    said = tuple(dict.fromkeys(notes))
    _KEPT.put({key: _packed(parts, said)})
    return parts, said


def _pieces(
    visual: Visual, found: dict[str, Path], textures: dict[str, Path | None], notes: list[str]
) -> list[Part]:
    scale, source = np.ones(3), ""
    if isinstance(visual.shape, Mesh):
        pieces, said = mesh_files.read(found[visual.shape.filename])
        notes += said
        scale, source = visual.shape.scale, found[visual.shape.filename].name
    else:
        pieces = [_primitive(visual.shape)]
    colour = visual.colour
    if visual.texture is not None:
        picture = textures[visual.texture]
        mean = (
            None
            if picture is None
            else materials.textured(picture, None, pieces[0].faces, pieces[0].vertices)[0]
        )
        if mean is None:
            notes.append(
                f"link '{visual.link}': its texture {visual.texture} cannot be read: no colour of it"
            )
        colour = mean or colour
    own = len({piece.colour for piece in pieces if piece.colour is not None}) > 1
    parts = []
    for piece in pieces:
        faces = piece.faces[:, ::-1] if np.prod(scale) < 0 else piece.faces
        vertices = (piece.vertices * scale) @ visual.origin[:3, :3].T + visual.origin[:3, 3]
        chosen = (piece.colour if own else None) or colour or piece.colour or _GREY
        name = f"{visual.link}/{piece.name}"
        indices = np.ascontiguousarray(faces, np.int32)
        parts.append(Part(name, visual.link, chosen, vertices, indices, source=source))
    return parts


def _primitive(shape: Primitive) -> Piece:
    import trimesh

    if shape.kind == "box":
        mesh = trimesh.creation.box(shape.sizes)
    elif shape.kind == "cylinder":
        mesh = trimesh.creation.cylinder(*shape.sizes, sections=64)
    else:
        mesh = trimesh.creation.icosphere(4, *shape.sizes)
    return Piece(shape.kind, np.asarray(mesh.vertices, float), np.asarray(mesh.faces, np.int64), None)


def _seen_from_both_sides(parts: tuple[Part, ...]) -> tuple[Part, ...]:
    """The parts with the faces marked whose backs are seen, judged over all parts of a link together."""
    from hecbench.robots.sheets import seen_from_behind

    marked = list(parts)
    for link in dict.fromkeys(part.link for part in parts):
        of_link = [i for i, part in enumerate(parts) if part.link == link]
        first = np.cumsum([0, *(len(parts[i].vertices) for i in of_link)])
        vertices = np.concatenate([parts[i].vertices for i in of_link])
        faces = np.concatenate([parts[i].faces + start for i, start in zip(of_link, first, strict=False)])
        _, place, merged = np.unique(
            np.round(vertices / _SAME_M).astype(np.int64), axis=0, return_index=True, return_inverse=True
        )
        behind = seen_from_behind(vertices[place], merged.reshape(-1)[faces])
        ends = np.cumsum([len(parts[i].faces) for i in of_link])[:-1]
        for i, both in zip(of_link, np.split(behind, ends), strict=True):
            marked[i] = replace(parts[i], both_sides=both)
    return tuple(marked)


def _digest(urdf: Path, used: Iterable[Path]) -> bytes:
    """Of the URDF, of every mesh and texture, of the files that these name, and of the program that reads them."""
    named = (other for path in used for other in referenced_files(path))
    digest = hashlib.sha256()
    for path in [*sorted(Path(__file__).parent.glob("*.py")), urdf, *sorted({*used, *named})]:
        digest.update(hashlib.sha256(path.read_bytes()).digest())
    return digest.digest()


def _unpacked(kept: bytes) -> tuple[tuple[Part, ...], tuple[str, ...]]:
    with np.load(io.BytesIO(kept), allow_pickle=False) as data:
        columns = zip(data["names"], data["links"], data["colours"], data["sources"], strict=True)
        parts = tuple(
            Part(
                str(name),
                str(link),
                (float(rgb[0]), float(rgb[1]), float(rgb[2])),
                data[f"vertices{i}"],
                data[f"faces{i}"],
                data[f"both_sides{i}"],
                str(source),
            )
            for i, (name, link, rgb, source) in enumerate(columns)
        )
        return parts, tuple(str(note) for note in data["notes"])


def _packed(parts: tuple[Part, ...], notes: tuple[str, ...]) -> bytes:
    arrays: dict[str, Any] = {
        "names": np.array([part.name for part in parts]),
        "links": np.array([part.link for part in parts]),
        "colours": np.array([part.colour for part in parts], float).reshape(-1, 3),
        "sources": np.array([part.source for part in parts], str),
        "notes": np.array(notes, str),
    }
    for i, part in enumerate(parts):
        arrays |= {f"vertices{i}": part.vertices, f"faces{i}": part.faces, f"both_sides{i}": part.both_sides}
    stream = io.BytesIO()
    np.savez(stream, **arrays)
    return stream.getvalue()
