"""Coloured visual meshes of a URDF's links (OBJ, STL, DAE, primitive shapes), parsed once and cached on disk.

The cache holds plain arrays under the hash of everything they were made from; a damaged or stale entry is
made anew.
"""

from __future__ import annotations

import hashlib
import os
import tempfile
import zipfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hecbench import cache
from hecbench.errors import InputError
from hecbench.robots.urdf_files import find_mesh

_CACHE_VERSION = 1
_GREY = (0.7, 0.7, 0.7)


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


def visual_parts(robot: Any, urdf: Path) -> tuple[Part, ...]:
    """All visual parts of a yourdfpy robot, from the cache when nothing changed.

    Raises:
        InputError: a mesh file is missing, unreadable or without faces; the message names it.
    """
    files = {
        visual.geometry.mesh.filename: find_mesh(visual.geometry.mesh.filename, urdf)
        for link in robot.links
        for visual in link.visuals
        if visual.geometry.mesh is not None
    }
    entry = cache.folder() / f"robot-{_digest(urdf, files)}.npz"
    parts = _read(entry)
    if parts is None:
        parts = tuple(
            part
            for link in robot.links
            for visual in link.visuals
            for part in _visual_parts(link.name, visual, files, _named_colours(robot))
        )
        _write(entry, parts)
    return parts


def _named_colours(robot: Any) -> dict[str, Any]:
    return {material.name: material.color for material in robot.materials if material.color is not None}


def _visual_parts(link: str, visual: Any, files: dict[str, Path], named: dict[str, Any]) -> list[Part]:
    import trimesh

    geometry = visual.geometry
    scale = np.ones(3)
    if geometry.mesh is not None:
        meshes = _mesh_file(files[geometry.mesh.filename])
        if geometry.mesh.scale is not None:
            scale = np.broadcast_to(np.asarray(geometry.mesh.scale, float), 3)
    elif geometry.box is not None:
        meshes = {"box": trimesh.creation.box(geometry.box.size)}
    elif geometry.cylinder is not None:
        shape = geometry.cylinder
        meshes = {"cylinder": trimesh.creation.cylinder(shape.radius, shape.length, sections=64)}
    else:
        meshes = {"sphere": trimesh.creation.icosphere(4, geometry.sphere.radius)}
    urdf_colour = _urdf_colour(visual.material, named)
    origin = np.eye(4) if visual.origin is None else np.asarray(visual.origin, float)
    parts = []
    for name, mesh in meshes.items():
        faces = np.asarray(mesh.faces, np.int32)
        if np.prod(scale) < 0:
            faces = faces[:, ::-1]
        vertices = (np.asarray(mesh.vertices, float) * scale) @ origin[:3, :3].T + origin[:3, 3]
        parts.append(Part(f"{link}/{name}", link, urdf_colour or _mesh_colour(mesh), vertices, faces))
    return parts


def _mesh_file(path: Path) -> dict[str, Any]:
    """Meshes by material name of one file, placed as the file's own scene places them."""
    import trimesh

    try:
        scene = trimesh.load_scene(str(path), process=False)
        meshes: dict[str, Any] = {}
        for node in scene.graph.nodes_geometry:
            transform, name = scene.graph[node]
            mesh = scene.geometry[name].copy()
            mesh.apply_transform(transform)
            material = getattr(getattr(mesh.visual, "material", None), "name", None)
            label = str(material or path.stem)
            meshes[label if label not in meshes else f"{label}.{len(meshes)}"] = mesh
    except Exception as error:  # each format's parser raises its own errors
        raise InputError(
            f"{path}: not a readable mesh: {(str(error) or type(error).__name__).splitlines()[0]}"
        ) from error
    meshes = {name: mesh for name, mesh in meshes.items() if len(getattr(mesh, "faces", ()))}
    if not meshes:
        raise InputError(f"{path}: the mesh has no faces: export it as triangles")
    if not all(np.isfinite(mesh.vertices).all() for mesh in meshes.values()):
        raise InputError(f"{path}: the mesh has vertices that are not finite")
    return meshes


def _urdf_colour(material: Any, named: dict[str, Any]) -> tuple[float, float, float] | None:
    if material is None:
        return None
    colour = material.color if material.color is not None else named.get(material.name)
    return None if colour is None else _rgb(np.asarray(colour.rgba, float))


def _mesh_colour(mesh: Any) -> tuple[float, float, float]:
    material = getattr(mesh.visual, "material", None)
    if material is not None:
        return _rgb(np.asarray(material.main_color, float) / 255)
    if getattr(mesh.visual, "kind", None) in ("face", "vertex"):
        return _rgb(np.asarray(mesh.visual.face_colors, float).mean(0) / 255)
    return _GREY


def _rgb(rgba: NDArray[np.float64]) -> tuple[float, float, float]:
    red, green, blue = (float(value) for value in rgba[:3])
    return red, green, blue


def _digest(urdf: Path, files: dict[str, Path]) -> str:
    """A hash of the URDF, of every mesh and of the material files beside them."""
    materials = {path.with_suffix(".mtl") for path in files.values()}
    digest = hashlib.sha256(f"{_CACHE_VERSION}".encode())
    for path in [urdf, *sorted({*files.values(), *(path for path in materials if path.is_file())})]:
        digest.update(hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()[:32]


def _read(entry: Path) -> tuple[Part, ...] | None:
    try:
        with np.load(entry, allow_pickle=False) as data:
            columns = zip(data["names"], data["links"], data["colours"], strict=True)
            return tuple(
                Part(str(name), str(link), _rgb(colour), data[f"vertices{i}"], data[f"faces{i}"])
                for i, (name, link, colour) in enumerate(columns)
            )
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile):
        return None


def _write(entry: Path, parts: tuple[Part, ...]) -> None:
    """Write aside, then rename; a folder that cannot be written only costs the next start its time."""
    arrays: dict[str, Any] = {
        "names": np.array([part.name for part in parts]),
        "links": np.array([part.link for part in parts]),
        "colours": np.array([part.colour for part in parts], float).reshape(-1, 3),
    }
    for i, part in enumerate(parts):
        arrays |= {f"vertices{i}": part.vertices, f"faces{i}": part.faces}
    try:
        entry.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=entry.parent, suffix=".npz", delete=False) as aside:
            np.savez(aside, **arrays)
        os.replace(aside.name, entry)
    except OSError:
        return
