"""Colours of mesh materials: from MTL and COLLADA effects, textures averaged over what is drawn with them."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np
from numpy.typing import NDArray

from hecbench.errors import InputError
from hecbench.robots import xml
from hecbench.system import files, pictures

Colour = tuple[float, float, float]
_LFS = b"version https://git-lfs"


@dataclass(frozen=True)
class Material:
    """The diffuse colour, RGB in [0, 1], and the texture, a file or its content, that stands in its place.

    `tint` multiplies the texture.
    """

    colour: Colour | None = None
    texture: Path | bytes | None = None
    tint: Colour = (1.0, 1.0, 1.0)


def mesh_bytes(path: Path) -> bytes:
    """The content of a mesh file; an `InputError` for what Git LFS left in its place."""
    content = files.read_bytes(path)
    if content.startswith(_LFS):
        raise InputError(f"{path}: is a Git LFS pointer, not a mesh: run git lfs pull")
    return content


def _text(path: Path) -> str:
    return files.read_bytes(path).decode("utf-8", "replace")


def libraries_of(obj: str) -> list[str]:
    """The material files that an OBJ file names; a name may hold blanks."""
    found = re.finditer(r"mtllib ([^\r\n]*)", obj)
    names = [m[1].strip() for m in found if not obj[obj.rfind("\n", 0, m.start()) + 1 : m.start()].strip()]
    return [word for name in names for word in ([name] if name.count(".") < 2 else name.split())]


def of_mtl(path: Path) -> dict[str, Material]:
    """Materials of an MTL file by name."""
    found: dict[str, Material] = {}
    name = ""
    for line in _text(path).splitlines():
        key, _, value = line.strip().partition(" ")
        value = value.strip()
        if key == "newmtl":
            name = value
            found[name] = Material()
        elif key == "Kd" and name:
            found[name] = Material(_colour(value), found[name].texture)
        elif key == "map_Kd" and name and value:
            place = path.parent / _path(value if "-" not in value.split()[0] else value.split()[-1])
            found[name] = Material(found[name].colour, place)
    return found


def of_collada(root: Any, path: Path) -> dict[str, Material]:
    """Materials of a COLLADA document by the id of their effect; the diffuse colour, or else the emission."""
    images = {
        image.get("id", ""): "".join(next(_below(image, "init_from")).itertext()).strip()
        for image in _below(root, "image")
        if next(_below(image, "init_from"), None) is not None
    }
    found = {}
    for effect in _below(root, "effect"):
        samplers = {
            new.get("sid"): "".join(part.itertext()).strip()
            for new in _below(effect, "newparam")
            for part in (*_below(new, "source"), *_below(new, "init_from"))
        }
        material = Material()
        for channel in ("diffuse", "emission"):
            part = next(_below(effect, channel), None)
            if part is None:
                continue
            texture = next(_below(part, "texture"), None)
            if texture is not None:
                name = texture.get("texture", "")
                for _ in range(2):  # sampler, then surface
                    name = samplers.get(name, name)
                file = images.get(name)
                material = Material(None, path.parent / _path(file or name))
            elif (colour := next(_below(part, "color"), None)) is not None:
                material = Material(_colour(colour.text or ""))
            break
        found[effect.get("id", "")] = material
    return found


def _below(element: Any, name: str) -> Iterator[Any]:
    return (child for child in element.iter() if isinstance(child.tag, str) and xml.local_name(child) == name)


def _path(name: str) -> str:
    return unquote(name.removeprefix("file://")).replace("\\", "/")


def _colour(text: str) -> Colour | None:
    try:
        red, green, blue = (float(np.clip(float(word), 0, 1)) for word in text.split()[:3])
    except ValueError:
        return None
    return (red, green, blue) if np.isfinite([red, green, blue]).all() else None


def textured(
    texture: Path | bytes,
    uv: NDArray[np.float64] | None,
    faces: NDArray[np.int64],
    vertices: NDArray[np.float64],
) -> tuple[Colour | None, str | None]:
    """The mean colour of a texture over the faces (F, 3) that wear it, by area; or why there is none.

    Args:
        texture: a file, or its content.
        uv: (V, 2) texture coordinates, v upwards; None: the mean of the whole picture.
        faces: vertices of the triangles.
        vertices: (V, 3) m.
    """
    try:
        where = str(texture) if isinstance(texture, Path) else "the picture inside the file"
        picture = pictures.image(texture, where).astype(float) / 255
    except InputError as error:
        return None, str(error)
    if uv is None or len(uv) != len(vertices):
        mean = picture.mean((0, 1))
    else:
        corners = vertices[faces]
        area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
        u, v = np.nan_to_num(uv[faces].mean(1)).T % 1.0
        height, width = picture.shape[:2]
        columns = np.minimum((u * width).astype(int), width - 1)
        rows = np.minimum(((1 - v) * height).astype(int), height - 1)
        mean = np.average(picture[rows, columns], axis=0, weights=area + 1e-12)
    red, green, blue = (float(value) for value in mean)
    return (red, green, blue), None
