"""Cameras: a folder, a video in place of a USB camera, pylon's own emulator, and what absence says."""

import numpy as np
import pytest
from hecbench_hardware.devices import DeviceFault, Fault
from PIL import Image

from hecbench.errors import InputError
from hecbench.registry import load
from hecbench.specs import DeviceSpec, Kind

HEIGHT, WIDTH = 48, 64


def camera(name, **options):
    return load().get(Kind.CAMERA, name, DeviceSpec).open({k: str(v) for k, v in options.items()})


@pytest.fixture
def pictures():
    return np.random.default_rng(0).integers(0, 255, (3, HEIGHT, WIDTH, 3), np.uint8)


@pytest.fixture
def folder(tmp_path, pictures):
    for k, picture in enumerate(pictures):
        Image.fromarray(picture).save(tmp_path / f"{k}.png")
    return tmp_path


def test_folder_serves_its_images_in_order(folder, pictures):
    device = camera("images", folder=folder)
    for k, picture in enumerate(pictures):
        frame = device.grab()
        assert np.array_equal(frame.image, picture)
        assert frame.source == f"{k}.png"
        assert frame.camera_stamp_s is None
    with pytest.raises(DeviceFault, match="all 3 images are used") as caught:
        device.grab()
    assert caught.value.fault is Fault.CAMERA
    assert device.intrinsics() is None
    device.close()
    again = camera("images", folder=folder, loop="yes")
    assert [again.grab().source for _ in range(4)][-1] == "0.png"


def test_folder_bad_input(tmp_path):
    with pytest.raises(InputError, match="not a folder"):
        camera("images", folder=tmp_path / "absent")
    with pytest.raises(InputError, match="holds no image"):
        camera("images", folder=tmp_path)
    (tmp_path / "torn.png").write_bytes(b"\x89PNG half")
    with pytest.raises(DeviceFault, match=r"torn.png: cannot be read as an image"):
        camera("images", folder=tmp_path).grab()


def test_uvc_reads_video(tmp_path, pictures):
    import cv2

    path = str(tmp_path / "clip.avi")
    writer = cv2.VideoWriter(path, cv2.VideoWriter.fourcc(*"MJPG"), 10, (WIDTH, HEIGHT))
    smooth = [np.full((HEIGHT, WIDTH, 3), (200, 100, 20 * k), np.uint8) for k in range(3)]
    for picture in smooth:
        writer.write(picture[..., ::-1])
    writer.release()
    device = camera("uvc", device=path, width=WIDTH, height=HEIGHT, exposure=100)
    for picture in smooth:
        frame = device.grab(10.0)
        assert frame.image.shape == (HEIGHT, WIDTH, 3)
        assert np.abs(frame.image.astype(float) - picture).mean() < 5
    with pytest.raises(DeviceFault, match="no more frames"):
        device.grab(10.0)
    assert device.intrinsics() is None
    device.close()
    with pytest.raises(InputError, match="cannot be opened"):
        camera("uvc", device=tmp_path / "absent.avi")


@pytest.fixture
def emulator(monkeypatch):
    monkeypatch.setenv("PYLON_CAMEMU", "1")
    pytest.importorskip("pypylon")


def test_basler_serves_frames_through_the_emulator(emulator, folder, pictures):
    features = f"PixelFormat=RGB8Packed;ImageFilename={folder};ImageFileMode=On;TestImageSelector=Off"
    device = camera("basler", features=f"{features};Width={WIDTH};Height={HEIGHT}")
    try:
        frame = device.grab()
        assert any(np.array_equal(frame.image, picture) for picture in pictures)
        assert device.grab().source != frame.source
        assert device.intrinsics() is None
    finally:
        device.close()


def test_basler_bad_input(emulator):
    with pytest.raises(InputError, match="not connected"):
        camera("basler", serial="99999999")
    with pytest.raises(InputError, match="no feature Nonsense"):
        camera("basler", features="Nonsense=1")
    with pytest.raises(InputError, match="Name=Value"):
        camera("basler", features="ExposureAuto")


def test_basler_without_a_frame(emulator):
    device = camera("basler", features="TriggerSelector=FrameStart;TriggerMode=On;TriggerSource=Software")
    with pytest.raises(DeviceFault, match="no frame") as caught:
        device.grab(0.2)
    assert caught.value.fault is Fault.CAMERA
    device.close()
    with pytest.raises(DeviceFault, match="closed"):
        device.grab()


def test_a_missing_sdk_is_one_line():
    plugin = next(p for p in load().select(Kind.CAMERA) if p.name == "realsense")
    if plugin.status != "missing":
        pytest.skip("pyrealsense2 is installed here")
    with pytest.raises(InputError, match="pyrealsense2, not installed"):
        camera("realsense")
