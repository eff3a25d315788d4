"""One mesh file read: triangles by material, in metres, and every face that the file holds."""

from __future__ import annotations

import io
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hecbench.errors import InputError
from hecbench.robots import materials, xml
from hecbench.robots.materials import Colour, Material

_DEEPEST = 64
"""Nodes of a COLLADA scene within each other."""
_FARTHEST_M = 1e6
"""Of a vertex: beyond it the numbers are damaged, whatever the unit."""


@dataclass(frozen=True, eq=False)
class Piece:
    """Triangles of one material. `colour` is None where the file gives none."""

    name: str
    vertices: NDArray[np.float64]
    """(V, 3) m, in the file's frame."""
    faces: NDArray[np.int64]
    colour: Colour | None


def read(path: Path) -> tuple[list[Piece], list[str]]:
    """The pieces of a mesh file, and notes on what it lacks.

    Raises:
        InputError: it is unreadable, has no faces, loses faces on the way, or its vertices are no places.
    """
    content = materials.mesh_bytes(path)
    notes: list[str] = []
    loaders = {".dae": _collada, ".obj": _wavefront}
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


def _checked(path: Path, expected: int, pieces: list[Piece]) -> list[Piece]:
    found = sum(len(piece.faces) for piece in pieces)
    if found != expected:
        raise InputError(
            f"{path}: {found} of its {expected} faces could be read: export it again as triangles"
        )
    return pieces


def _piece(
    name: str, vertices: Any, faces: Any, material: Material, uv: Any, path: Path, notes: list[str]
) -> Piece:
    vertices, faces = np.asarray(vertices, float), np.asarray(faces, np.int64).reshape(-1, 3)
    used, faces = np.unique(faces, return_inverse=True)
    faces = faces.reshape(-1, 3)
    vertices, uv = vertices[used], None if uv is None else np.asarray(uv, float)[used]
    colour = material.colour
    if material.texture is not None:
        mean, fault = materials.textured(material.texture, uv, faces, vertices)
        colour = mean or colour
        if fault is not None:
            notes.append(f"mesh {path.name}: material {name} has lost its texture: {fault}")
    return Piece(name, vertices, faces, colour)


def _collada(content: bytes, path: Path, notes: list[str]) -> list[Piece]:
    """COLLADA in metres by its <unit>; its up_axis is ignored, as RViz does."""
    import collada
    from lxml import etree

    root = xml.parse(content, f"{path}: not a readable mesh", mesh=True)
    described = materials.of_collada(root, path)
    expected = _plain(root, path, notes)
    document = collada.Collada(io.BytesIO(etree.tostring(root)), ignore=[collada.common.DaeError])
    if document.errors:
        raise InputError(f"{path}: not a readable mesh: {str(document.errors[0]).splitlines()[0]}")
    unit = document.assetInfo.unitmeter or 1.0
    if not np.isclose(unit, 1.0):
        notes.append(f"mesh {path.name}: its unit of {unit:g} m is applied")
    pieces: list[Piece] = []
    for shape in () if document.scene is None else document.scene.objects("geometry"):
        for primitive in shape.primitives():
            triangles = primitive.triangleset() if hasattr(primitive, "triangleset") else primitive
            if not hasattr(triangles, "vertex_index") or triangles.vertex is None:
                continue
            faces = np.asarray(triangles.vertex_index).reshape(-1, 3)
            effect = getattr(getattr(triangles.material, "effect", triangles.material), "id", None)
            label = effect or path.stem
            vertices, uv = np.asarray(triangles.vertex, float) * unit, None
            if label in described and described[label].texture and len(triangles.texcoordset):
                chosen = np.asarray(triangles.texcoord_indexset[0]).reshape(-1, 3)
                uv = np.asarray(triangles.texcoordset[0], float)[chosen.ravel(), :2]
                vertices, faces = vertices[faces.ravel()], np.arange(faces.size).reshape(-1, 3)
            pieces.append(_piece(label, vertices, faces, described.get(label, Material()), uv, path, notes))
    return _labelled(_checked(path, expected, pieces))


_UNUSED = ("library_images", "library_lights", "library_cameras", "library_animations", "library_controllers")


def _plain(root: Any, path: Path, notes: list[str]) -> int:
    """Leave geometry and its placement in a COLLADA document, effects of one colour; the faces that it draws."""
    from lxml import etree

    by_name: dict[str, list[Any]] = {}
    for element in root.iter():
        if isinstance(element.tag, str):
            by_name.setdefault(xml.local_name(element), []).append(element)
    if by_name.get("instance_controller"):
        raise InputError(f"{path}: holds a skinned mesh: export it without armature")
    for name in (*_UNUSED, "instance_light", "instance_camera", "lines", "linestrips"):
        for element in by_name.get(name, ()):
            element.getparent().remove(element)
    space = root.tag.rpartition("}")[0] + "}" if "}" in root.tag else ""
    for effect in by_name.get("effect", ()):
        effect[:] = []
        at = effect
        for name in ("profile_COMMON", "technique", "lambert", "diffuse", "color"):
            at = etree.SubElement(at, space + name, {"sid": "common"} if name == "technique" else {})
        at.text = "0.5 0.5 0.5 1"
    effects = {effect.get("id") for effect in by_name.get("effect", ())}
    sound = set()
    for material in by_name.get("material", ()):
        uses = [
            e.get("url", "")[1:]
            for e in material.iter()
            if isinstance(e.tag, str) and xml.local_name(e) == "instance_effect"
        ]
        if uses and uses[0] in effects:
            sound.add(material.get("id"))
        else:
            material.getparent().remove(material)
    for use in by_name.get("instance_material", ()):
        if (name := use.get("target", "")[1:]) not in sound:
            notes.append(f"mesh {path.name}: material {name} is broken: its faces are drawn grey")
            use.getparent().remove(use)
    faces = {geometry.get("id"): sum(_face_counts(geometry)) for geometry in by_name.get("geometry", ())}
    return _drawn_faces(root, by_name, faces, path)


def _drawn_faces(root: Any, by_name: dict[str, list[Any]], faces: dict[str, int], path: Path) -> int:
    """Faces of the scene: each geometry as often as the nodes place it."""
    nodes = {node.get("id"): node for node in by_name.get("node", ()) if node.get("id")}

    def below(element: Any, depth: int) -> int:
        if depth > _DEEPEST:
            raise InputError(f"{path}: its nodes place each other: export it again")
        total = 0
        for child in element:
            kind = xml.local_name(child) if isinstance(child.tag, str) else ""
            name = child.get("url", "")[1:] if kind.startswith("instance_") else ""
            if kind == "node":
                total += below(child, depth + 1)
            elif kind == "instance_geometry":
                total += faces.get(name, 0)
            elif kind == "instance_node" and name in nodes:
                total += below(nodes[name], depth + 1)
        return total

    shown = [use.get("url", "")[1:] for use in by_name.get("instance_visual_scene", ())]
    scenes = [scene for scene in by_name.get("visual_scene", ()) if scene.get("id") in shown]
    return sum(below(scene, 0) for scene in scenes)


def _face_counts(geometry: Any) -> Iterator[int]:
    """Triangles of each primitive of a COLLADA geometry, counted by its declared polygons."""
    for element in geometry.iter():
        kind = xml.local_name(element) if isinstance(element.tag, str) else ""
        parts = {xml.local_name(part): part for part in element if isinstance(part.tag, str)}
        if kind == "triangles":
            yield int(element.get("count", 0))
        elif kind == "polylist" and "vcount" in parts:
            yield sum(max(int(word) - 2, 0) for word in (parts["vcount"].text or "").split())
        elif kind in ("polygons", "tristrips", "trifans"):
            stride = 1 + max(
                (int(p.get("offset", 0)) for p in element if xml.local_name(p) == "input"), default=0
            )
            strips = [p for p in element if xml.local_name(p) == "p"]
            yield sum(max(len((p.text or "").split()) // stride - 2, 0) for p in strips)


def _wavefront(content: bytes, path: Path, notes: list[str]) -> list[Piece]:
    """OBJ: its faces by trimesh, its materials from the MTL files that it names."""
    text = content.decode("utf-8", "replace")
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
    expected = sum(len(line.split()) - 3 for line in lines if line.startswith("f "))
    plain = "\n".join(["mtllib own", *lines]).encode()
    pieces = _other(plain, path, notes, resolver=_Library(grey), described=described)
    return _checked(path, expected, pieces)


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
    if resolver is None and suffix == "gltf":
        resolver = trimesh.resolvers.FilePathResolver(str(path))
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
        if described is None:
            pieces.append(
                _piece(label, mesh.vertices, mesh.faces, Material(_mesh_colour(mesh)), None, path, notes)
            )
        else:
            uv = getattr(mesh.visual, "uv", None)
            named = described.get(label, Material(_vertex_colour(mesh)))
            pieces.append(_piece(label, mesh.vertices, mesh.faces, named, uv, path, notes))
    pieces = _labelled(pieces)
    return _checked(path, _stl_faces(content), pieces) if suffix == "stl" else pieces


def _stl_faces(content: bytes) -> int:
    """Facets of a binary STL, which may start with "solid" too, or of an ASCII one."""
    count = int.from_bytes(content[80:84], "little") if len(content) >= 84 else -1
    return count if len(content) >= 84 + 50 * count >= 84 else len(re.findall(rb"(?im)^\s*facet\s", content))


def _labelled(pieces: list[Piece]) -> list[Piece]:
    """Names made unique with their place."""
    seen: set[str] = set()
    named: list[Piece] = []
    for piece in pieces:
        name = piece.name if piece.name not in seen else f"{piece.name}.{len(named)}"
        seen.add(name)
        named.append(Piece(name, piece.vertices, piece.faces, piece.colour))
    return named


def _mesh_colour(mesh: Any) -> Colour | None:
    material = getattr(mesh.visual, "material", None)
    if material is None:
        return _vertex_colour(mesh)
    picture = getattr(material, "baseColorTexture", None)
    if picture is not None:
        return _rgb(np.asarray(picture.convert("RGB"), float).reshape(-1, 3).mean(0) / 255)
    return _rgb(np.asarray(material.main_color, float) / 255)


def _vertex_colour(mesh: Any) -> Colour | None:
    if getattr(mesh.visual, "kind", None) in ("face", "vertex"):
        return _rgb(np.asarray(mesh.visual.face_colors, float).mean(0) / 255)
    return None


def _rgb(rgba: NDArray[np.float64]) -> Colour:
    red, green, blue = (float(value) for value in rgba[:3])
    return red, green, blue
