"""The files that a URDF consists of: its meshes found, and all copied together."""

from __future__ import annotations

from glob import escape
from itertools import takewhile
from pathlib import Path
from urllib.parse import unquote

from hecbench.errors import InputError
from hecbench.robots import urdf as urdf_reader
from hecbench.robots.references import referenced_files
from hecbench.system import files

_PACKAGES = ("package://", "model://")
_MESHES = (".stl", ".obj", ".dae", ".ply", ".glb", ".gltf")
_FOLDERS_ABOVE = 4
"""Of the URDF, that are searched: description packages nest it by two or three."""
_FOLDERS_BELOW = 3
_LEAST_AGREEING = 2
"""Names at the end of a path that was found otherwise nowhere: a file's alone does not tell visual from collision."""


def find_mesh(filename: str, urdf: Path) -> Path:
    """The mesh file: relative to the URDF's folder or one above it, with or without a package's name.

    The place that agrees with most of the name counts: ``package://arm/visual/a.stl`` is rather ``../visual/a.stl``
    than an ``a.stl`` beside the URDF. Backslashes separate folders too.
    """
    if not filename.lower().endswith(_MESHES):
        raise InputError(f"{urdf}: mesh '{filename}' is no mesh file; use one of {' '.join(_MESHES)}")
    if (found := _found(filename, urdf)) is None:
        raise InputError(
            f"{urdf}: mesh '{filename}' is not there: put it beside the URDF or correct its path"
        )
    return found


def find_texture(filename: str, urdf: Path) -> Path | None:
    """The texture of a URDF material, found like a mesh; None when it is not there."""
    return _found(filename, urdf)


def _found(filename: str, urdf: Path) -> Path | None:
    of_package = filename.startswith(_PACKAGES)
    name = filename.removeprefix("file://")
    for prefix in _PACKAGES:
        name = name.removeprefix(prefix)
    places = (urdf.parent, *urdf.parent.absolute().parents[:_FOLDERS_ABOVE])
    for spelled in dict.fromkeys((name, name.replace("\\", "/"), unquote(name))):
        parts = Path(spelled).parts
        tails = [Path(*parts[skip:]) for skip in range(len(parts) if of_package else 1)]
        for tail in tails:
            for place in places:
                if (place / tail).is_file():
                    return place / tail
    return _below(Path(name.replace("\\", "/")), urdf.parent) if of_package else None


def _below(name: Path, folder: Path) -> Path | None:
    """The file below a folder that agrees with most of a name's end, in its own folder's name at least."""
    patterns = ("/".join(["*"] * depth + [escape(name.name)]) for depth in range(1, _FOLDERS_BELOW + 1))
    found = [path for pattern in patterns for path in sorted(folder.glob(pattern)) if path.is_file()]
    agreeing = [len(_common_end(path.parts, name.parts)) for path in found]
    best = max(agreeing, default=0)
    return found[agreeing.index(best)] if best >= _LEAST_AGREEING and agreeing.count(best) == 1 else None


def _common_end(one: tuple[str, ...], other: tuple[str, ...]) -> list[str]:
    pairs = zip(reversed(one), reversed(other), strict=False)
    return [a for a, _ in takewhile(lambda pair: pair[0] == pair[1], pairs)]


def copy(urdf: Path, folder: Path) -> Path:
    """Write the URDF with its visual meshes, their material files and textures into a folder; returns the copy.

    Collision shapes and other programs' extensions are left out: nothing here uses them. Meshes of one folder
    stay together.

    Raises:
        InputError: the URDF is not readable, or a mesh is not there.
    """
    from lxml import etree

    root = urdf_reader.parse(urdf)
    for link in root.iter("link"):
        for shape in link.findall("collision"):
            link.remove(shape)
    places: dict[Path, str] = {}
    for mesh in root.iter("mesh"):
        source = find_mesh(mesh.get("filename", ""), urdf)
        place = places.setdefault(source.parent, f"meshes/{len(places)}")
        for path in (source, *referenced_files(source)):
            inside = path.resolve().relative_to(source.parent.resolve()) if path != source else source.name
            files.write_bytes(folder / place / inside, files.read_bytes(path))
        mesh.set("filename", f"{place}/{source.name}")
    for texture in root.iter("texture"):
        if (found := find_texture(texture.get("filename", ""), urdf)) is not None:
            place = places.setdefault(found.parent, f"meshes/{len(places)}")
            files.write_bytes(folder / place / found.name, files.read_bytes(found))
            texture.set("filename", f"{place}/{found.name}")
    files.write_bytes(folder / urdf.name, etree.tostring(root, encoding="utf-8", xml_declaration=True))
    return folder / urdf.name
