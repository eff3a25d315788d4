"""OpenCV's AprilTag detector gives what pupil-apriltags gives."""

import cv2
import numpy as np
import pytest
from PIL import Image

from hecbench.errors import InputError
from hecbench.system import apriltags

NEAR_PX = 0.5
"""The two libraries fit the edges of a tag differently."""


def compare(grey, family):
    ours = {tag.id: tag for tag in apriltags.detected(grey, family)}
    theirs = {tag.id: tag for tag in apriltags.detected_by_opencv(grey, family)}
    both = ours.keys() & theirs.keys()
    offsets = [theirs[i].corners_px - ours[i].corners_px for i in both]
    return both, np.array(offsets)


@pytest.mark.parametrize("picture", ["test_image.png", "test_image_rotation_40.png"])
def test_on_photographs(shared, picture):
    grey = np.asarray(Image.open(shared / "data" / "pupil_tags" / picture).convert("L"))
    both, offsets = compare(grey, "tag36h11")
    assert both
    assert np.abs(offsets).max() < NEAR_PX
    assert np.abs(offsets.mean((0, 1))).max() < 0.2


@pytest.mark.parametrize("family", ["tag36h11", "tag25h9", "tag16h5"])
def test_on_drawn_tags(family):
    code = getattr(cv2.aruco, f"DICT_APRILTAG_{family.removeprefix('tag')}")
    tag = cv2.aruco.generateImageMarker(cv2.aruco.getPredefinedDictionary(code), 5, 240)
    grey = cv2.warpAffine(
        np.pad(tag, 120, constant_values=255), cv2.getRotationMatrix2D((240, 240), 25, 0.8), (480, 480),
        flags=cv2.INTER_AREA, borderValue=255,
    )  # fmt: skip
    both, offsets = compare(grey, family)
    assert both == {5}
    assert np.abs(offsets).max() < NEAR_PX


def test_it_takes_the_place_of_the_library_that_is_not_there(monkeypatch):
    monkeypatch.setattr(apriltags, "find_spec", lambda name: None)
    assert apriltags.detected(np.full((60, 80), 255, np.uint8), "tag36h11") == []
    with pytest.raises(InputError, match="pupil-apriltags"):
        apriltags.detected(np.zeros((60, 80), np.uint8), "tagCircle21h7")
