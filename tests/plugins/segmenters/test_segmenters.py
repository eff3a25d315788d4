"""Segmenters: masks of what moves and of what is drawn, and one reason where there are none."""

from dataclasses import replace

import numpy as np
import pytest
from hecbench_datasets.suites import synthetic
from hecbench_plugins.segmenters.background import by_background
from hecbench_plugins.segmenters.given import given
from hecbench_plugins.segmenters.grabcut import GrabCut
from hecbench_plugins.views.silhouettes import Silhouettes

from hecbench import se3
from hecbench.errors import Refusal
from hecbench.recording import CameraModel, Mounting
from hecbench.storage.recording_io import load


def iou(a, b):
    return (a & b).sum() / (a | b).sum()


def true_masks(recording):
    silhouettes = Silhouettes(recording)
    return [silhouettes.draw(i, recording.truth_parent_T_camera) for i in range(len(recording))]


@pytest.fixture(scope="module")
def before_a_wall():
    """Seven views of the synthetic robot, far apart, before a textured wall; without masks."""
    rng = np.random.default_rng(11)
    clean = synthetic.make("views_5", 0, 5)
    joints = np.deg2rad([[60 * k - 180, -90 + 12 * k, 90 - 20 * k, -90, -90, 0] for k in range(7)])
    wide = replace(
        clean,
        sample_ids=tuple(map(str, range(7))),
        joints_rad=joints,
        base_T_flange=None,
        images=None,
        masks=None,
    )
    masks = true_masks(wide)
    wall = np.kron(rng.integers(60, 200, (24, 32, 3)), np.ones((20, 20, 1))).astype(np.uint8)
    images = tuple(np.where(mask[..., None], np.uint8(240), wall) for mask in masks)
    return replace(wide, images=images), masks


def test_given_masks_are_passed_on_and_missing_ones_refused():
    recording = synthetic.make("LP", 0, 3)
    assert given(recording) is recording
    with pytest.raises(Refusal, match="has no masks"):
        given(replace(recording, masks=None))


def test_silhouettes_are_the_synthetic_masks():
    recording = synthetic.make("LP", 1, 3)
    assert iou(true_masks(recording)[0], recording.mask(0)) > 0.98


def test_silhouettes_follow_the_lens():
    """A pixel of the lens' image is robot where the ray through it meets the robot in the pinhole image."""
    recording = synthetic.make("LP", 1, 3)
    camera = replace(recording.camera, distortion=np.array([-0.3, 0.08, 0.001, -0.001, 0]))
    bent = true_masks(replace(recording, camera=camera))[0]
    straight = true_masks(recording)[0]
    from hecbench.rendering.undistort import Undistortion

    again = Undistortion.of(camera).image(bent.astype(np.uint8) * np.uint8(255)) > 0.5
    assert iou(again, straight) > 0.98
    assert iou(bent, straight) < iou(again, straight) - 0.01


def test_background_finds_what_moves_and_the_start_tells_what_stands(before_a_wall):
    recording, masks = before_a_wall
    without_start = by_background(replace(recording, initial_parent_T_camera=None))
    moving = [iou(without_start.mask(i), mask) for i, mask in enumerate(masks)]
    started = by_background(replace(recording, initial_parent_T_camera=recording.truth_parent_T_camera))
    found = [iou(started.mask(i), mask) for i, mask in enumerate(masks)]
    assert min(found) > 0.9
    assert np.mean(moving) < np.mean(found)
    assert "stays unknown" in without_start.notes[-1]
    assert "drawn at the start" in started.notes[-1]


def test_background_drops_what_moves_far_from_the_robot(before_a_wall):
    recording, _ = before_a_wall
    images = [image.copy() for image in recording.images]
    images[2][:60, :60] = (255, 0, 255)
    disturbed = replace(recording, images=tuple(images))
    assert by_background(replace(disturbed, initial_parent_T_camera=None)).mask(2)[20, 20]
    started = replace(disturbed, initial_parent_T_camera=recording.truth_parent_T_camera)
    assert not by_background(started).mask(2)[20, 20]


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda r: r.subset([0, 1]), "2 images"),
        (lambda r: replace(r, mounting=Mounting.EYE_IN_HAND), "moves with the flange"),
        (lambda r: replace(r, images=(r.images[0],) * len(r), initial_parent_T_camera=None), "nothing moves"),
    ],
)
def test_background_says_why_not(before_a_wall, change, reason):
    recording, _ = before_a_wall
    with pytest.raises(Refusal, match=reason):
        by_background(change(recording))


def test_grabcut_separates_a_bright_robot_and_leaves_its_start_behind(before_a_wall):
    recording, masks = before_a_wall
    off = se3.exp([0.0, 0.01, 0.01, 0.01, 0.0, 0.01])
    start = recording.truth_parent_T_camera @ off
    few = replace(recording, initial_parent_T_camera=start).subset([0, 3])
    drawn = Silhouettes(few).draw(0, start)
    found = GrabCut()(few)
    assert iou(found.mask(0), masks[0]) > max(0.85, iou(drawn, masks[0]))
    np.testing.assert_array_equal(found.masks[0], GrabCut()(few).masks[0])


def test_grabcut_says_what_it_lacks(before_a_wall):
    recording, _ = before_a_wall
    with pytest.raises(Refusal, match="needs initial"):
        GrabCut()(replace(recording, initial_parent_T_camera=None))
    away = recording.truth_parent_T_camera @ np.diag([-1.0, 1, -1, 1])
    with pytest.raises(Refusal, match="out of sight"):
        GrabCut()(replace(recording, initial_parent_T_camera=away))


def test_segmenters_on_real_images(shared):
    """What moves in the photographs is mostly the robot, and the board that it holds, which is not in its model."""
    recording = load(shared / "data/ur3e_cam1").subset([0, 9, 18, 27, 36])
    assert isinstance(recording.camera, CameraModel)
    started = replace(recording.without_truth(), initial_parent_T_camera=recording.truth_parent_T_camera)
    found = by_background(started)
    overlap = [iou(found.mask(i), mask) for i, mask in enumerate(true_masks(recording))]
    assert np.mean(overlap) > 0.5
