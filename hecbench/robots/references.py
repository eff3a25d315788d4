"""The files that a mesh file names, beside it or below."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TypeGuard

from hecbench.robots import xml
from hecbench.robots.gltf_files import Document
from hecbench.robots.materials import libraries_of, mesh_bytes, of_collada, of_mtl


def referenced_files(mesh: Path) -> list[Path]:
    """The files without which a mesh loses shape or colours and that lie beside or below it."""
    return sorted({path for path in _named(mesh) if _is_below(path, mesh)})


def _named(mesh: Path) -> Iterator[Path | bytes | None]:
    match mesh.suffix.lower():
        case ".obj":
            for name in libraries_of(mesh_bytes(mesh).decode("utf-8", "replace")):
                if _is_below(library := mesh.parent / name, mesh):
                    yield library
                    yield from (material.texture for material in of_mtl(library).values())
        case ".dae":
            root = xml.parse(mesh_bytes(mesh), f"{mesh}: not a readable mesh", mesh=True)
            yield from (material.texture for material in of_collada(root, mesh).values())
        case ".gltf" | ".glb":
            yield from Document.of(mesh_bytes(mesh), mesh).references()


def _is_below(path: Path | bytes | None, mesh: Path) -> TypeGuard[Path]:
    if not isinstance(path, Path) or not path.is_file():
        return False
    folders = {mesh.parent.resolve(), mesh.resolve().parent}
    return any(path.resolve().is_relative_to(folder) for folder in folders)
