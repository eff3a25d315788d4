"""The suite `synthetic`: what its levels promise, and that an item depends on nothing but its three numbers."""

import numpy as np
import pytest
from hecbench_datasets.suites import synthetic

from hecbench import se3


def test_items_are_reproducible_and_differ():
    first, again, other = (synthetic.make("MP", index, 3) for index in (5, 5, 6))
    assert first.sha256 == again.sha256
    assert first.sha256 != other.sha256
    assert first.sha256 != synthetic.make("MP", 5, 4).sha256


@pytest.mark.parametrize(("level", "low", "high"), [("LP", 0, 0.1), ("MP", 0.1, 0.2), ("HP", 0.2, 0.3)])
def test_start_errors_stay_in_their_ranges(level, low, high):
    for index in range(20):
        scene = synthetic.scene(level, index, 0)
        offset = np.abs(scene.start_camera_T_base[:3, 3] - scene.camera_T_base[:3, 3])
        assert (low <= offset).all()
        assert (offset <= high).all()
        assert 0 < se3.rotation_error_rad(scene.start_camera_T_base, scene.camera_T_base) < 0.31


def test_the_robot_is_whole_in_the_picture():
    for index in range(5):
        mask = synthetic.make("HP", index, 0).mask(0)
        assert 0.02 < mask.mean() < 0.1
        assert not mask[0].any()
        assert not mask[:, [0, -1]].any()


def test_levels_are_paired_and_change_what_they_say():
    plain = synthetic.make("LP", 2, 0)
    for level in synthetic.LEVELS:
        if level in synthetic.START_RANGES_M:
            continue
        item = synthetic.make(level, 2, 0)
        np.testing.assert_array_equal(item.truth_parent_T_camera, plain.truth_parent_T_camera)
        np.testing.assert_array_equal(item.initial_parent_T_camera, plain.initial_parent_T_camera)
        changed_image = not np.array_equal(item.image(0), plain.image(0))
        changed_mask = not np.array_equal(item.mask(0), plain.mask(0))
        changed_joints = not np.array_equal(item.joints_rad[0], plain.joints_rad[0])
        more_views = len(item) > 1
        assert changed_image or changed_mask or changed_joints or more_views, level
    assert len(synthetic.make("views_5", 2, 0)) == 5
    hidden = 1 - synthetic.make("occlusion", 2, 0).mask(0).sum() / plain.mask(0).sum()
    assert hidden == pytest.approx(0.2, abs=0.02)


def test_floor_is_zero_without_mismatch_and_grows_with_it():
    floors = [synthetic.correspondence_floor_mm(level, 0, 0) for level in ("LP", "mismatch_1", "mismatch_5")]
    assert floors[0] < 1e-3
    assert floors[0] < floors[1] < floors[2]
