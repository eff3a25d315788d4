"""One decoder: every kind of image file or array is scaled, turned or refused in words."""

import io
import shutil
import struct
import subprocess
import sys
import zlib

import numpy as np
import pytest
from PIL import Image

from hecbench.errors import InputError
from hecbench.storage import recording_io
from hecbench.system import pictures

RAMP = np.tile(np.arange(256, dtype=np.uint8), (4, 1))
SQUARE = np.pad(np.ones((10, 12), np.uint8), 8)


def _file(array, format="PNG", **options):
    stream = io.BytesIO()
    Image.fromarray(array).save(stream, format, **options)
    return stream.getvalue()


@pytest.mark.parametrize(
    "source",
    [
        RAMP,
        _file(RAMP),
        _file(RAMP.astype(np.uint16) * 257),
        _file(RAMP.astype(np.uint16) * 257, "TIFF"),
        _file(RAMP.astype(np.int32) * 257, "TIFF"),
        _file(RAMP.astype(np.float32) / 255, "TIFF"),
        RAMP.astype(np.uint16) * 257,
        RAMP / 255.0,
        np.stack([RAMP] * 4, 2),
        _file(np.stack([RAMP] * 3, 2), "BMP"),
    ],
)
def test_every_depth_gives_the_same_image(source):
    np.testing.assert_array_equal(pictures.image(source, "a"), np.stack([RAMP] * 3, 2))


def test_orientation_of_exif_is_honoured(tmp_path):
    """All eight orientations bring the picture back as it is shown."""
    shown = np.random.default_rng(1).integers(0, 255, (6, 9, 3), np.uint8)
    undo = [
        lambda a: a,
        lambda a: a[:, ::-1],
        lambda a: a[::-1, ::-1],
        lambda a: a[::-1],
        lambda a: a.transpose(1, 0, 2),
        lambda a: np.rot90(a),
        lambda a: a[::-1, ::-1].transpose(1, 0, 2),
        lambda a: np.rot90(a, -1),
    ]
    for orientation, stored in enumerate(undo, 1):
        exif = Image.Exif()
        exif[0x0112] = orientation
        path = tmp_path / f"{orientation}.png"
        path.write_bytes(_file(np.ascontiguousarray(stored(shown)), exif=exif))
        np.testing.assert_array_equal(pictures.image(path, "a"), shown)
        assert pictures.size(path) == (9, 6)


def _palette(indices, colours):
    picture = Image.fromarray(indices)
    picture = Image.frombytes("P", picture.size, indices.tobytes())
    picture.putpalette(colours)
    stream = io.BytesIO()
    picture.save(stream, "PNG")
    return stream.getvalue()


@pytest.mark.parametrize(
    "source",
    [
        SQUARE * np.uint8(255),
        SQUARE,
        SQUARE > 0,
        SQUARE * np.uint8(38),
        SQUARE.astype(np.uint16),
        SQUARE.astype(np.int64) * 65535,
        SQUARE * 0.9,
        _file(SQUARE),
        _file(SQUARE > 0),
        _file(SQUARE.astype(np.uint16)),
        _file(SQUARE.astype(np.uint16) * 65535),
        _file(SQUARE[..., None] * np.array([128, 0, 0], np.uint8)),
        _palette(SQUARE, [0, 0, 0, 128, 0, 0]),
        _palette(SQUARE, [0, 0, 0, 255, 255, 255]),
        _palette(1 - SQUARE, [255, 255, 255, 0, 0, 0]),
        _file(np.dstack([SQUARE * 0 + np.uint8(255)] * 3 + [SQUARE * np.uint8(255)])),
    ],
)
def test_every_way_to_write_a_mask(source):
    np.testing.assert_array_equal(pictures.mask(source, "m"), SQUARE > 0)


@pytest.mark.parametrize("values", [(1, 2), (1, 2, 3, 40), (3, 255)])
def test_label_images_are_named(values):
    labels = SQUARE.copy()
    for row, value in enumerate(values):
        labels[10 + row] *= np.uint8(value)
    labels[13:][labels[13:] > 0] = values[0]
    with pytest.raises(InputError, match=r"m: the mask holds 0, .*label image. write 255 = robot"):
        pictures.mask(labels, "m")


def test_soft_edges_are_no_labels():
    soft = np.minimum(255, SQUARE * np.uint16(255) + np.roll(SQUARE, 1, 0) * np.uint16(90)).astype(np.uint8)
    np.testing.assert_array_equal(pictures.mask(soft, "m"), SQUARE > 0)
    assert not pictures.mask(SQUARE * np.uint8(0), "m").any()


@pytest.mark.parametrize(
    ("source", "reason"),
    [
        (_file(RAMP.astype(np.uint16)), "end at 255 of 65535"),
        (_file(RAMP.astype(np.uint16) * 16, "TIFF"), "end at 4080 of 65535"),
        (_file(RAMP.astype(np.float32), "TIFF"), "floats from 0 to 255; scale them to 0..1"),
        (np.full((4, 4, 3), np.nan), "not finite"),
        (_file(RAMP.astype(np.int32) * 70000, "TIFF"), "save 8 or 16 bits"),
        (np.zeros((4, 4, 5), np.uint8), r"shape \(4, 4, 5\)"),
        (b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 99 99\n{} loop\n", "none of PNG, JPEG"),
        (_file(RAMP, "GIF"), "none of PNG, JPEG"),
        (_file(RAMP)[:60], "cannot be read as an image"),
        (b"", "cannot be read as an image"),
    ],
)
def test_what_fits_no_scale_is_refused_in_one_line(source, reason):
    with pytest.raises(InputError, match=reason) as refused:
        pictures.image(source, "a.png")
    assert str(refused.value).startswith("a.png: ")
    assert "\n" not in str(refused.value)


def _header_of(width, height):
    """A PNG that is all header: decoding it is never reached."""

    def chunk(kind, body):
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    ihdr = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return (
        b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", ihdr) + chunk(b"IDAT", zlib.compress(b"")) + chunk(b"IEND", b"")
    )


@pytest.mark.parametrize("side", [9000, 9500, 12_000, 20_000, 200_000])
def test_huge_images_are_refused_before_decoding(side, tmp_path):
    path = tmp_path / "a.png"
    path.write_bytes(_header_of(side, side))
    for read in (lambda: pictures.size(path), lambda: pictures.image(path, str(path))):
        with pytest.raises(InputError, match=r"a.png: "):
            read()


def test_a_picture_of_one_bits_from_the_shared_case(shared, tmp_path):
    case = shared / "cases" / "robot" / "mask_of_zeros_and_ones"
    recording = recording_io.load(case)
    share = recording.mask(0).mean()
    assert 0.02 < share < 0.9
    again = tmp_path / "again"
    shutil.copytree(case, again)
    mask = next((again / "masks").iterdir())
    mask.chmod(0o644)
    Image.fromarray(np.asarray(Image.open(mask)) * np.uint8(255)).save(mask)
    np.testing.assert_array_equal(recording_io.load(again).mask(0), recording.mask(0))


def test_check_ends_in_words_on_a_picture_that_is_a_program(tmp_path):
    """A .png that holds PostScript starts nothing: `check` names it."""
    folder = tmp_path / "cell"
    (folder / "images").mkdir(parents=True)
    (folder / "images" / "a.png").write_bytes(b"%!PS-Adobe-3.0 EPSF-3.0\n%%BoundingBox: 0 0 64 48\n{} loop\n")
    (folder / "recording.json").write_text(
        '{"schema": "hecbench.recording/1", "name": "c", "mounting": "eye_to_hand", '
        '"camera": {"width": 64, "height": 48, "K": [[50,0,32],[0,50,24],[0,0,1]]}, '
        '"samples": [{"id": "a", "joints_rad": [0,0,0,0,0,0], "image": "images/a.png"}]}'
    )
    run = subprocess.run(
        [sys.executable, "-m", "hecbench", "check", str(folder), "--json"],
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert "Traceback" not in run.stderr
    assert "none of PNG" in run.stdout + run.stderr
