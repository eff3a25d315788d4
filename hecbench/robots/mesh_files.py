"""One mesh file read: triangles by material, in metres, and every face that the file holds."""

from __future__ import annotations

import io
import re
import warnings
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hecbench.errors import InputError
from hecbench.robots import collada_files, gltf_files, materials
from hecbench.robots.materials import Colour, Material
from hecbench.robots.pieces import Piece, checked, labelled, piece

_FARTHEST_M = 1e6
"""Of a vertex: beyond it the numbers are damaged, whatever the unit."""


def read(path: Path) -> tuple[list[Piece], list[str]]:
    """The pieces of a mesh file, and notes on what it lacks.

    Raises:
        InputError: it is unreadable, has no faces, loses faces on the way, or its vertices are no places.
    """
    content = materials.mesh_bytes(path)
    notes: list[str] = []
    loaders = {".dae": collada_files.read, ".obj": _wavefront, ".gltf": _gltf, ".glb": _gltf}
    try:
        pieces = loaders.get(path.suffix.lower(), _other)(content, path, notes)
    except InputError:
        raise
    except Exception as error:  # each format's parser raises its own errors
        reason = (str(error) or type(error).__name__).splitlines()[0]
        raise InputError(f"{path}: not a readable mesh: {reason}") from error
    pieces = [piece for piece in pieces if len(piece.faces)]
    if not pieces:
        raise InputError(f"{path}: the mesh has no faces: export it as triangles")
    farthest = max(float(np.abs(piece.vertices).max()) for piece in pieces)
    if not farthest <= _FARTHEST_M:
        raise InputError(
            f"{path}: the mesh has a vertex at {farthest:g} m; not finite or damaged: export it again"
        )
    return pieces, notes


def _wavefront(content: bytes, path: Path, notes: list[str]) -> list[Piece]:
    """OBJ: its faces by trimesh, its materials from the MTL files that it names."""
    text = content.decode("utf-8", "replace").replace("\t", " ")
    described: dict[str, Material] = {}
    for name in materials.libraries_of(text):
        if (library := path.parent / name.replace("\\", "/")).is_file():
            described |= materials.of_mtl(library)
        else:
            notes.append(f"mesh {path.name}: its material file {name} is missing: drawn grey")
    lines = [line.strip() for line in text.replace("\\\n", " ").splitlines()]
    lines = _counted_from_the_first([line for line in lines if not line.startswith("mtllib ")])
    used = {line[7:].strip() for line in lines if line.startswith("usemtl ")}
    grey = "".join(f"newmtl {name}\nKd 0.5 0.5 0.5\n" for name in sorted(used)).encode()
    corners = [line.split()[1:] for line in lines if line.startswith("f ")]
    if any(corner.split("/")[0] == "0" for face in corners for corner in face):
        raise InputError(f"{path}: a face names vertex 0, and OBJ counts from 1: export it again")
    expected = sum(len(face) - 2 for face in corners)
    plain = "\n".join(["mtllib own", *lines]).encode()
    pieces = _other(plain, path, notes, resolver=_Library(grey), described=described)
    return checked(path, expected, pieces)


def _gltf(content: bytes, path: Path, notes: list[str]) -> list[Piece]:
    """glTF: its faces by trimesh, its materials here."""
    from trimesh.resolvers import FilePathResolver

    document = gltf_files.Document.of(content, path)
    expected, plain = document.least_faces(), document.plain()
    pieces = _other(
        plain, path, notes, resolver=FilePathResolver(str(path)), described=document.materials(notes)
    )
    return pieces if sum(len(piece.faces) for piece in pieces) > expected else checked(path, expected, pieces)


def _counted_from_the_first(lines: list[str]) -> list[str]:
    """The lines with negative indices, which count back from the line they stand in, made positive."""
    counts = {"v": 0, "vt": 0, "vn": 0}
    places = []
    for line in lines:
        key, _, rest = line.partition(" ")
        if key in counts:
            counts[key] += 1
        if key == "f" and "-" in rest:
            corners = [
                "/".join(
                    str(counts[kind] + 1 + int(index)) if index.startswith("-") else index
                    for kind, index in zip(("v", "vt", "vn"), corner.split("/"), strict=False)
                )
                for corner in rest.split()
            ]
            places.append(f"f {' '.join(corners)}")
        else:
            places.append(line)
    return places


class _Library:
    """What trimesh asks for further files gets the one material file that was written for it."""

    def __init__(self, content: bytes) -> None:
        self._content = content

    def get(self, name: str) -> bytes:
        """The same content under every name."""
        return self._content

    __getitem__ = get


def _other(
    content: bytes,
    path: Path,
    notes: list[str],
    *,
    resolver: Any = None,
    described: dict[str, Material] | None = None,
) -> list[Piece]:
    """What trimesh reads, placed as the file's own scene places it."""
    import trimesh

    suffix = path.suffix.lower().lstrip(".")
    if suffix in ("glb", "gltf"):
        suffix = "glb" if content.startswith(b"glTF") else "gltf"
    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # of numbers that `piece` refuses in words
        scene = trimesh.load_scene(io.BytesIO(content), file_type=suffix, process=False, resolver=resolver)
    pieces = []
    for node in scene.graph.nodes_geometry:
        transform, name = scene.graph[node]
        mesh = scene.geometry[name].copy()
        mesh.apply_transform(transform)
        if not hasattr(mesh, "faces"):
            continue
        material = getattr(getattr(mesh.visual, "material", None), "name", None)
        label = str(material or path.stem)
        uv = getattr(mesh.visual, "uv", None)
        named = (described or {}).get(label, Material(_vertex_colour(mesh)))
        pieces.append(piece(label, mesh.vertices, mesh.faces, named, uv, path, notes))
    pieces = labelled(pieces)
    return checked(path, _stl_faces(content), pieces) if suffix == "stl" else pieces


def _stl_faces(content: bytes) -> int:
    """Facets that a binary STL, which may start with "solid" too, declares, or that an ASCII one holds."""
    count = int.from_bytes(content[80:84], "little") if len(content) >= 84 else -1
    if len(content) >= 84 + 50 * count >= 84:
        return count
    listed = len(re.findall(rb"(?im)^\s*facet\s", content))
    return listed if listed or content[:5].lower() == b"solid" else max(count, 0)


def _vertex_colour(mesh: Any) -> Colour | None:
    if getattr(mesh.visual, "kind", None) in ("face", "vertex"):
        return _rgb(np.asarray(mesh.visual.face_colors, float).mean(0) / 255)
    return None


def _rgb(rgba: NDArray[np.float64]) -> Colour:
    red, green, blue = (float(value) for value in rgba[:3])
    return red, green, blue
