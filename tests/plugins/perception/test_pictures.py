"""What the network is taught: keypoints by a rule, and pictures whose labels are true."""

import numpy as np
import pytest
from hecbench_plugins.perception.family import Family
from hecbench_plugins.perception.pictures import PictureMaker
from hecbench_plugins.perception.scene import random_scene
from hecbench_plugins.perception.skeleton import keypoint_positions, keypoints_of

from hecbench import se3
from hecbench.errors import InputError
from hecbench.robots.model import load_robot

SIZE = 96


@pytest.fixture(scope="module")
def family():
    return Family.of(["ur5e", "ur3e"])


def test_arms_of_one_maker_have_the_same_keypoints(family):
    first, second = ([k.link for k in arm.keypoints] for arm in family.arms)
    assert first == second
    assert len(first) == 10
    assert len(family.palette) == 5


def test_keypoints_stay_on_their_joint_axes_when_the_joints_turn(crane):
    model = load_robot(crane)
    keypoints = keypoints_of(model)
    assert [k.link for k in keypoints] == ["foot", "foot", "upper", "upper", "fore"]
    for q in ([0.0, 0.0], [1.0, -0.7]):
        poses = model.link_poses(np.array(q))
        points = keypoint_positions(model.links, keypoints, poses)
        bend = poses[model.link_index("fore")]
        apart = points[[3, 4]] - bend[:3, 3]  # both on the axis of `bend`
        np.testing.assert_allclose(np.cross(apart, bend[:3, 1]), 0, atol=1e-12)


def test_keypoints_move_with_the_frame_of_the_links(family):
    arm, shift = family.arms[0], se3.from_rotvec([0.1, 0.2, -0.3], [1.0, 2.0, 3.0])
    poses = arm.model.link_poses(np.full(6, 0.4))
    moved = arm.keypoint_positions(shift @ poses)
    np.testing.assert_allclose(moved, se3.transform_points(shift, arm.keypoint_positions(poses)))


def test_the_same_seed_draws_the_same_pictures(family):
    first, second = (PictureMaker(family, SIZE, 5).example() for _ in range(2))
    np.testing.assert_array_equal(first.image, second.image)
    np.testing.assert_array_equal(first.shares, second.shares)
    assert not np.array_equal(first.image, PictureMaker(family, SIZE, 6).example().image)


def test_labels_agree_with_each_other(family):
    maker, empty = PictureMaker(family, SIZE, 2), 0
    for _ in range(80):
        example = maker.example()
        shares = example.shares.astype(float) / 255
        np.testing.assert_allclose(shares[..., :-1].sum(-1), 1, atol=0.02)  # colours share every cell
        whole, visible = 1 - shares[..., 0], shares[..., -1]
        assert (visible <= whole + 0.02).all()
        empty += not whole.any()
        if not whole.any():
            assert np.isnan(example.keypoints).all()
    assert 0 < empty < 20


def test_keypoints_lie_on_the_robot_that_is_drawn(family, rng):
    on = total = 0
    for _ in range(20):
        scene = random_scene(family.arms[0], SIZE, rng)
        drawn = scene.renderer.face >= 0
        pixels = np.rint(2 * scene.keypoint_pixels()[2:]).astype(int)  # drawn twice as large
        inside = ((pixels >= 0) & (pixels < 2 * SIZE)).all(1)
        on += drawn[pixels[inside, 1], pixels[inside, 0]].sum()
        total += inside.sum()
    assert on > 0.9 * total


def test_a_family_needs_robots_with_meshes_and_like_skeletons(crane):
    with pytest.raises(InputError, match="one robot or more"):
        Family.of([])
    with pytest.raises(InputError, match="train one network for each"):
        Family.of(["ur5e", str(crane)])
