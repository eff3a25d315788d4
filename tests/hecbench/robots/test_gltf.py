"""glTF meshes: geometry, colours and textures, and what is refused instead of being lost."""

import base64
import io
import json
import struct

import numpy as np
import pytest
from PIL import Image

from hecbench.errors import InputError
from hecbench.robots import mesh_files
from hecbench.robots.references import referenced_files

CORNERS = np.array([[x, y, z] for x in (0, 0.2) for y in (0, 0.2) for z in (0, 0.2)], np.float32)
QUADS = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
FACES = np.array([[(a, b, c), (a, c, d)] for a, b, c, d in QUADS], np.uint16)
LEFT = np.tile(np.float32([0.2, 0.5]), (8, 1))


def picture():
    """Red on the left, blue on the right."""
    pixels = np.zeros((8, 8, 3), np.uint8)
    pixels[:, :4, 0] = pixels[:, 4:, 2] = 255
    stream = io.BytesIO()
    Image.fromarray(pixels).save(stream, "png")
    return stream.getvalue()


def cube(**changes):
    """The document of a cube, and its binary."""
    arrays = [CORNERS, FACES.ravel(), LEFT]
    starts = np.cumsum([0, *(array.nbytes for array in arrays)]).tolist()
    told = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [
            {"primitives": [{"attributes": {"POSITION": 0, "TEXCOORD_0": 2}, "indices": 1, "material": 0}]}
        ],
        "materials": [{"name": "skin", "pbrMetallicRoughness": {"baseColorFactor": [0, 1, 0, 1]}}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 8, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": 36, "type": "SCALAR"},
            {"bufferView": 2, "componentType": 5126, "count": 8, "type": "VEC2"},
        ],
        "bufferViews": [
            {"buffer": 0, "byteOffset": start, "byteLength": array.nbytes}
            for start, array in zip(starts, arrays, strict=False)
        ],
        **changes,
    }
    return told, b"".join(array.tobytes() for array in arrays)


def write(path, told, binary):
    """As .gltf with a data URI, or as .glb."""
    if path.suffix == ".gltf":
        uri = "data:application/octet-stream;base64," + base64.b64encode(binary).decode()
        path.write_text(json.dumps({"buffers": [{"byteLength": len(binary), "uri": uri}], **told}))
        return path
    text = json.dumps({**told, "buffers": [{"byteLength": len(binary)}]}).encode()
    text, binary = text + b" " * (-len(text) % 4), binary + b"\0" * (-len(binary) % 4)
    body = (
        struct.pack("<II", len(text), 0x4E4F534A)
        + text
        + struct.pack("<II", len(binary), 0x004E4942)
        + binary
    )
    path.write_bytes(struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body)
    return path


def textured(image, factor=(1, 1, 1, 1)):
    pbr = {"baseColorTexture": {"index": 0}, "baseColorFactor": factor}
    return {
        "images": [image],
        "textures": [{"source": 0}],
        "materials": [{"name": "skin", "pbrMetallicRoughness": pbr}],
    }


@pytest.mark.parametrize("suffix", [".gltf", ".glb"])
def test_a_cube(tmp_path, suffix):
    pieces, notes = mesh_files.read(
        write(tmp_path / f"cube{suffix}", *cube(nodes=[{"mesh": 0, "scale": [2, 1, 1]}]))
    )
    assert not notes
    assert [(piece.name, len(piece.faces), piece.colour) for piece in pieces] == [("skin", 12, (0, 1, 0))]
    np.testing.assert_allclose(pieces[0].vertices.max(0), [0.4, 0.2, 0.2], atol=1e-6)


def test_textures_are_averaged_where_they_are_worn(tmp_path):
    (tmp_path / "skin.png").write_bytes(picture())
    data = "data:image/png;base64," + base64.b64encode(picture()).decode()
    told, binary = cube(**textured({"bufferView": 3, "mimeType": "image/png"}))
    told["bufferViews"].append({"buffer": 0, "byteOffset": len(binary), "byteLength": len(picture())})
    paths = [
        write(tmp_path / "data.gltf", *cube(**textured({"uri": data}))),
        write(tmp_path / "beside.gltf", *cube(**textured({"uri": "skin.png"}))),
        write(tmp_path / "inside.glb", told, binary + picture()),
    ]
    for path in paths:
        pieces, notes = mesh_files.read(path)
        assert not notes
        assert pieces[0].colour == pytest.approx((1, 0, 0))
    half = write(tmp_path / "half.gltf", *cube(**textured({"uri": "skin.png"}, (0.5, 1, 1, 1))))
    assert mesh_files.read(half)[0][0].colour == pytest.approx((0.5, 0, 0))


@pytest.mark.parametrize(
    ("image", "reason"),
    [
        ({"uri": "gone.png"}, "gone.png: does not exist"),
        ({"uri": "data:image/png;base64,AAAA"}, "the picture inside the file"),
        ({"mimeType": "image/png"}, "no picture of a known format"),
        ({"bufferView": 99}, "no picture of a known format"),
        (
            {"uri": "data:image/png;base64," + base64.b64encode(b"%!PS-Adobe-3.0 EPSF-3.0").decode()},
            "the picture inside",
        ),
    ],
)
def test_a_lost_texture_costs_a_colour_and_is_said(tmp_path, image, reason):
    pieces, notes = mesh_files.read(write(tmp_path / "cube.gltf", *cube(**textured(image, (0, 0, 1, 1)))))
    assert len(pieces[0].faces) == 12
    assert pieces[0].colour == (0, 0, 1)
    assert len(notes) == 1
    assert reason in notes[0]
    assert "material skin has lost its texture" in notes[0]


def test_materials_of_one_name_stay_two(tmp_path):
    told, binary = cube(
        materials=[
            {"name": "a", "pbrMetallicRoughness": {"baseColorFactor": c}}
            for c in ([1, 0, 0, 1], [0, 0, 1, 1])
        ],
        nodes=[{"mesh": 0, "children": [1]}, {"mesh": 1, "translation": [1, 0, 0]}],
    )
    told["meshes"] += [{"primitives": [{**told["meshes"][0]["primitives"][0], "material": 1}]}]
    pieces, _ = mesh_files.read(write(tmp_path / "two.glb", told, binary))
    assert sorted(piece.colour for piece in pieces) == [(0, 0, 1), (1, 0, 0)]
    assert sum(len(piece.faces) for piece in pieces) == 24


def changed(part, **changes):
    told, _ = cube()
    told[part] = [{**told[part][0], **changes}, *told[part][1:]]
    return {part: told[part]}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"extensionsRequired": ["KHR_draco_mesh_compression"]},
            "needs the extension KHR_draco_mesh_compression",
        ),
        (changed("accessors", sparse={"count": 1}), "sparse accessors"),
        ({"meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "mode": 6}]}]}, "triangle fans"),
        ({"meshes": [{"primitives": [{"attributes": {"POSITION": 0}, "mode": 1}]}]}, "has no faces"),
        ({"buffers": [{"byteLength": 4, "uri": "gone.bin"}]}, "its buffer gone.bin is missing"),
        ({"scenes": []}, "has no scene"),
        ({"nodes": [{"mesh": 0, "children": [0]}]}, "node 0 stands in the scene twice"),
        ({"asset": {"version": "1.0"}}, "is glTF 1.0"),
        ({"materials": 5}, "materials is no list of objects"),
        ({"nodes": [{"mesh": 7}]}, "not a readable mesh"),
    ],
)
def test_geometry_is_refused_in_words_rather_than_lost(tmp_path, changes, message):
    with pytest.raises(InputError, match=message):
        mesh_files.read(write(tmp_path / "cube.gltf", *cube(**changes)))


@pytest.mark.parametrize(
    "content", [b"", b"{", b"glTF", b"[]", b"glTF\2\0\0\0\xff\xff\0\0\1\0\0\0JSON{}", b"[" * 10**5]
)
def test_damaged_files(tmp_path, content):
    path = tmp_path / "cube.glb"
    path.write_bytes(content)
    with pytest.raises(InputError, match="not a readable mesh"):
        mesh_files.read(path)


def test_the_files_that_it_names_go_with_it(tmp_path):
    (tmp_path / "skin.png").write_bytes(picture())
    (tmp_path / "cube.bin").write_bytes(cube()[1])
    told = {**cube(**textured({"uri": "skin.png"}))[0], "buffers": [{"byteLength": 196, "uri": "cube.bin"}]}
    path = write(tmp_path / "cube.gltf", told, b"")
    assert [file.name for file in referenced_files(path)] == ["cube.bin", "skin.png"]
    assert len(mesh_files.read(path)[0][0].faces) == 12
