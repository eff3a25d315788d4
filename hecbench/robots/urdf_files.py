"""The files that a URDF consists of: its meshes found, and all copied together."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

from hecbench import files
from hecbench.errors import InputError

_PACKAGE = "package://"
_MESHES = (".stl", ".obj", ".dae", ".ply", ".glb", ".gltf")


def find_mesh(filename: str, urdf: Path) -> Path:
    """The mesh file: relative to the URDF's folder or one above it, with or without a package's name."""
    if not filename.lower().endswith(_MESHES):
        raise InputError(f"{urdf}: mesh '{filename}' is no mesh file; use one of {' '.join(_MESHES)}")
    relative = Path(filename.removeprefix(_PACKAGE).removeprefix("file://"))
    tails = [Path(*relative.parts[skip:]) for skip in range(len(relative.parts))]
    places = (urdf.parent, *urdf.parent.absolute().parents[:2])
    for place in places:
        for tail in tails if filename.startswith(_PACKAGE) else [relative]:
            if (place / tail).is_file():
                return place / tail
    raise InputError(f"{urdf}: mesh '{filename}' is not there: put it beside the URDF or correct its path")


def copy(urdf: Path, folder: Path) -> Path:
    """Write the URDF with its visual meshes and their material files into a folder; returns the copy.

    Collision shapes are left out: nothing here uses them. Meshes of one folder stay together.

    Raises:
        InputError: the URDF is no XML, or a mesh is not there.
    """
    try:
        root = ElementTree.fromstring(files.read_bytes(urdf))
    except ElementTree.ParseError as error:
        raise InputError(f"{urdf}: not a readable URDF: {error}") from error
    for link in root.iter("link"):
        for shape in link.findall("collision"):
            link.remove(shape)
    places: dict[Path, str] = {}
    for mesh in root.iter("mesh"):
        source = find_mesh(mesh.get("filename", ""), urdf)
        place = places.setdefault(source.parent, f"meshes/{len(places)}")
        for path in (source, *_materials(source)):
            files.write_bytes(folder / place / path.name, files.read_bytes(path))
        mesh.set("filename", f"{place}/{source.name}")
    files.write_bytes(folder / urdf.name, ElementTree.tostring(root))
    return folder / urdf.name


def _materials(mesh: Path) -> list[Path]:
    """The material files that an OBJ file names and that lie beside it; others are left where they are."""
    if mesh.suffix.lower() != ".obj":
        return []
    lines = files.read_bytes(mesh).decode("utf-8", "replace").splitlines()
    named = {word for line in lines if line.startswith("mtllib ") for word in line.split()[1:]}
    folders = mesh.parent.resolve(), mesh.resolve().parent
    found = (mesh.parent / name for name in named)
    return sorted(path for path in found if path.is_file() and path.resolve().parent in folders)
