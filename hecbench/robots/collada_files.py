"""COLLADA meshes: the document reduced to geometry and its placement, so that no broken material costs a face."""

from __future__ import annotations

import io
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from hecbench.errors import InputError
from hecbench.robots import materials, xml
from hecbench.robots.materials import Material
from hecbench.robots.pieces import Piece, checked, labelled, piece

_DEEPEST = 64
"""Nodes of a COLLADA scene within each other."""


def read(content: bytes, path: Path, notes: list[str]) -> list[Piece]:
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
            pieces.append(piece(label, vertices, faces, described.get(label, Material()), uv, path, notes))
    return labelled(checked(path, expected, pieces))


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
