"""glTF meshes: the document reduced to geometry and its placement; colours and textures are read here."""

from __future__ import annotations

import base64
import binascii
import json
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import numpy as np

from hecbench.errors import InputError
from hecbench.robots.materials import Material
from hecbench.system import files

_MAGIC, _JSON, _BINARY = b"glTF", 0x4E4F534A, 0x004E4942
_TRIANGLES, _TRIANGLE_FAN = 4, 6
_HARMLESS = ("KHR_materials_", "KHR_texture_", "KHR_lights_", "EXT_texture_", "MSFT_texture_")
"""Beginnings of extensions that move no vertex."""


@dataclass(frozen=True)
class Document:
    """A glTF file: its JSON, and the binary chunk of a GLB."""

    path: Path
    told: dict[str, Any]
    chunk: bytes

    @staticmethod
    def of(content: bytes, path: Path) -> Document:
        """Read a .gltf or .glb file.

        Raises:
            InputError: it is damaged, or of another version than 2.
        """
        text, chunk = content, b""
        if content.startswith(_MAGIC):
            parts = dict(_chunks(content, path))
            text, chunk = parts.get(_JSON, b""), parts.get(_BINARY, b"")
        try:
            told = json.loads(text.decode("utf-8-sig"))
            version = str(told["asset"]["version"])
        except (ValueError, KeyError, TypeError, RecursionError):
            raise InputError(f"{path}: not a readable mesh: no glTF document: export it again") from None
        if not version.startswith("2."):
            raise InputError(f"{path}: is glTF {version}, and 2.0 is read: export it as glTF 2.0")
        return Document(path, told, chunk)

    def plain(self) -> bytes:
        """The file without pictures, each material named by its number, for a reader of geometry.

        Raises:
            InputError: a buffer is missing, or the geometry is compressed, sparse or drawn as fans.
        """
        for one in self._all("buffers"):
            if (place := self._outside(one)) is not None and not place.is_file():
                raise InputError(f"{self.path}: its buffer {one['uri']} is missing: copy it beside the mesh")
        told = {
            key: value for key, value in self.told.items() if key not in ("images", "textures", "samplers")
        }
        for name in told.pop("extensionsRequired", ()):
            if not str(name).startswith(_HARMLESS):
                raise InputError(
                    f"{self.path}: needs the extension {name}, which is not read: export it without"
                )
        told.pop("extensionsUsed", None)
        if any("sparse" in accessor for accessor in self._all("accessors")):
            raise InputError(f"{self.path}: holds sparse accessors, which are not read: export it without")
        if any(part.get("mode", _TRIANGLES) == _TRIANGLE_FAN for part in self._primitives()):
            raise InputError(f"{self.path}: holds triangle fans, which are not read: export it as triangles")
        told["materials"] = [{"name": label} for label in self.labels()]
        text = json.dumps(told).encode()
        if not self.chunk:
            return text
        text += b" " * (-len(text) % 4)
        chunk = self.chunk + b"\0" * (-len(self.chunk) % 4)
        parts = [(_JSON, text), (_BINARY, chunk)]
        body = b"".join(struct.pack("<II", len(part), kind) + part for kind, part in parts)
        return struct.pack("<4sII", _MAGIC, 2, 12 + len(body)) + body

    def least_faces(self) -> int:
        """Triangles of the scene that are listed one by one."""
        accessors = self._all("accessors")
        total = 0
        for node in self._placed():
            for part in self._all("meshes")[node["mesh"]].get("primitives", ()) if "mesh" in node else ():
                if part.get("mode", _TRIANGLES) == _TRIANGLES:
                    total += accessors[part.get("indices", part["attributes"]["POSITION"])]["count"] // 3
        return total

    def labels(self) -> list[str]:
        """A name of its own for each material."""
        names = [str(told.get("name", "material")) for told in self._all("materials")]
        return [f"{name}.{k}" if names.count(name) > 1 else name for k, name in enumerate(names)]

    def materials(self, notes: list[str]) -> dict[str, Material]:
        """Colours and textures by `labels`; what is lost joins the notes."""
        each = zip(self.labels(), self._all("materials"), strict=True)
        return {label: self._material(label, told, notes) for label, told in each}

    def _material(self, label: str, told: dict[str, Any], notes: list[str]) -> Material:
        glossy = told.get("extensions", {}).get("KHR_materials_pbrSpecularGlossiness", {})
        rough = told.get("pbrMetallicRoughness", {})
        factor = rough.get("baseColorFactor") or glossy.get("diffuseFactor") or (1.0, 1.0, 1.0)
        red, green, blue = (float(np.clip(value, 0, 1)) for value in factor[:3])
        colour = red, green, blue
        texture = rough.get("baseColorTexture") or glossy.get("diffuseTexture")
        if texture is None:
            return Material(colour)
        try:
            image = self._all("images")[self._all("textures")[texture["index"]]["source"]]
            return Material(colour, self._picture(image), colour)
        except (InputError, LookupError, TypeError, ValueError) as error:
            reason = error if isinstance(error, InputError) else "no picture of a known format"
            notes.append(f"mesh {self.path.name}: material {label} has lost its texture: {reason}")
            return Material(colour)

    def references(self) -> Iterator[Path]:
        """The files that it names: buffers and pictures."""
        for one in (*self._all("buffers"), *self._all("images")):
            if (place := self._outside(one)) is not None:
                yield place

    def _picture(self, image: dict[str, Any]) -> Path | bytes:
        if "bufferView" not in image:
            return self._outside(image) or _data(image["uri"])
        view = self._all("bufferViews")[image["bufferView"]]
        buffer = self._all("buffers")[view["buffer"]]
        if (place := self._outside(buffer)) is not None:
            content = files.read_bytes(place)
        else:
            content = _data(buffer["uri"]) if "uri" in buffer else self.chunk
        first = view.get("byteOffset", 0)
        return content[first : first + view["byteLength"]]

    def _placed(self) -> Iterator[dict[str, Any]]:
        """The nodes of the scene, each once."""
        scenes, nodes = self._all("scenes"), self._all("nodes")
        if not scenes:
            raise InputError(f"{self.path}: has no scene, so that nothing is placed: export it with one")
        waiting, seen = list(scenes[self.told.get("scene", 0)].get("nodes", ())), set()
        while waiting:
            if (number := waiting.pop()) in seen:
                raise InputError(f"{self.path}: node {number} stands in the scene twice: export it again")
            seen.add(number)
            waiting += nodes[number].get("children", ())
            yield nodes[number]

    def _primitives(self) -> Iterator[dict[str, Any]]:
        return (part for mesh in self._all("meshes") for part in mesh.get("primitives", ()))

    def _outside(self, one: dict[str, Any]) -> Path | None:
        """The file of a buffer or picture; None where it is in the document itself."""
        uri = one.get("uri")
        if not isinstance(uri, str) or uri.startswith("data:"):
            return None
        return self.path.parent / unquote(uri).replace("\\", "/")

    def _all(self, name: str) -> list[dict[str, Any]]:
        found = self.told.get(name, [])
        if not isinstance(found, list) or not all(isinstance(one, dict) for one in found):
            raise InputError(
                f"{self.path}: not a readable mesh: {name} is no list of objects: export it again"
            )
        return found


def _chunks(content: bytes, path: Path) -> Iterator[tuple[int, bytes]]:
    """Kind and content of each chunk of a GLB."""
    if len(content) < 12:
        raise InputError(f"{path}: not a readable mesh: it ends early: export it again")
    _, version, total = struct.unpack_from("<4sII", content)
    if version != 2:
        raise InputError(f"{path}: is glTF {version}, and 2.0 is read: export it as glTF 2.0")
    place = 12
    while place + 8 <= total:
        length, kind = struct.unpack_from("<II", content, place) if place + 8 <= len(content) else (1, 0)
        part = content[place + 8 : place + 8 + length]
        if len(part) < length:
            raise InputError(f"{path}: not a readable mesh: it ends early: export it again")
        yield kind, part
        place += 8 + length


def _data(uri: str) -> bytes:
    header, _, text = uri.partition(",")
    if not header.endswith(";base64"):
        return unquote(text).encode("latin-1", "replace")
    try:
        return base64.b64decode(text)
    except binascii.Error as error:
        raise InputError(f"a data URI is damaged ({error})") from None
