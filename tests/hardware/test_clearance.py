"""What is driven is what is checked, and nothing slips between the samples of a motion."""

from dataclasses import replace

import numpy as np
import pytest
from hecbench_hardware.clearance import RESOLUTION_M, body_points, check_motion, check_pose, tool_line
from hecbench_hardware.controller_sim.arm import SimulatedArm, vector_of
from hecbench_hardware.controller_sim.motions import move_linear
from hecbench_hardware.kinematics import ARMS
from hecbench_hardware.limits import Box, Limits, Sphere
from hecbench_hardware.motions import JointMotion, LineMotion, motion_time_s, six_joints
from hecbench_hardware.trials import solids

from hecbench import se3
from hecbench.errors import InputError

ARM = ARMS["ur5e"]
PAN = np.eye(6)[0]
"""One radian of the first joint."""
LONG_TOOL = se3.make(se3.so3_exp([0.2, 0.1, 0.0]), [0.03, 0.0, 0.45])
SMALL = Sphere((0.0, 0.0, 0.0), 1e-6)
TIP = Sphere((0.05, 0.0, 0.25), 1e-6)
"""Far enough from the arm that a wall there is not the arm's."""
BESIDE = Sphere((0.12, 0.0, 0.0), 1e-6)
KINDS = ("first joint", "joints", "line", "long tool")
EVERYWHERE = Box((-9.0, -9.0, -9.0), (9.0, 9.0, 9.0))


def turned_about(flange_T_tcp, joints, turn, shift=(0.0, 0.0, 0.0)):
    """base_T_flange after the tool was turned about its centre point, and shifted."""
    base_T_tcp = ARM.forward(joints) @ flange_T_tcp
    turned = se3.make(se3.so3_exp(turn) @ base_T_tcp[:3, :3], base_T_tcp[:3, 3] + shift)
    return turned @ se3.inverse(flange_T_tcp)


@pytest.fixture
def motions(ready_pose):
    """One of each kind: joints, a line of the flange, a line of a long tool with a large turn."""
    return {
        "first joint": JointMotion(ARM, ready_pose, ready_pose + 0.8 * PAN),
        "joints": JointMotion(ARM, ready_pose, np.add(ready_pose, [0.8, 0.3, -0.4, 0.2, 0.1, 1.0])),
        "line": LineMotion(
            ARM, ready_pose, turned_about(np.eye(4), ready_pose, [0, 0, 0.4], [0.1, 0.1, 0.05])
        ),
        "long tool": LineMotion(
            ARM, ready_pose, turned_about(LONG_TOOL, ready_pose, [0.5, 0.7, 0.3], [0.05, 0, 0.1]), LONG_TOOL
        ),
    }


def densely(motion, count=2001):
    """Joints (N, 6) at very many fractions of the way."""
    joints = [motion.joints[0]]
    for fraction in np.linspace(0, 1, count)[1:]:
        joints.append(motion.at(fraction, joints[-1]))
    return np.array(joints)


def test_joint_motion_keeps_its_ends(ready_pose):
    motion = JointMotion(ARM, ready_pose, np.add(ready_pose, [1.0, -0.5, 0.2, 0, 0, 3.0]))
    assert np.array_equal(motion.joints[0], motion.start)
    assert motion.joints[-1] == pytest.approx(motion.end)


def test_line_of_the_flange_is_straight(ready_pose):
    start = ARM.forward(ready_pose)
    target = turned_about(np.eye(4), ready_pose, [0, 0, 0.4], [0.1, 0.1, 0.05])
    poses = ARM.forward(LineMotion(ARM, ready_pose, target).joints)
    assert poses[-1] == pytest.approx(target, abs=1e-9)
    direction = (target - start)[:3, 3] / np.linalg.norm((target - start)[:3, 3])
    offsets = poses[:, :3, 3] - start[:3, 3]
    assert np.abs(offsets - np.outer(offsets @ direction, direction)).max() < 1e-9


def test_the_controller_drives_the_line_that_is_checked(motions):
    """Every cycle of the simulated controller lies on it; with a tool the flange follows an arc far from its chord."""
    motion = motions["long tool"]
    driven = SimulatedArm(ARM)
    driven.joints = motion.start.copy()
    driven.set_tcp(vector_of(LONG_TOOL))
    cycles = [motion.start]
    for _ in move_linear(driven, motion.base_T_tcp, 0.25, 0.5):
        cycles.append(driven.joints)
    flange = ARM.forward(np.array(cycles))
    way = np.linalg.norm((flange @ LONG_TOOL)[:, :3, 3] - (flange[0] @ LONG_TOOL)[:3, 3], axis=1)
    for joints, fraction in zip(cycles, way / np.linalg.norm(motion.shift_m), strict=True):
        assert motion.at(fraction, joints) == pytest.approx(joints, abs=1e-8)
    chord = flange[0, :3, 3] + np.linspace(0, 1, 500)[:, None] * (flange[-1] - flange[0])[:3, 3]
    assert np.linalg.norm(flange[:, None, :3, 3] - chord, axis=2).min(1).max() > 0.04


def between_samples(motion):
    """Fractions that lie well between two samples of a motion."""
    rng, steps = np.random.default_rng(1), len(motion.fractions) - 1
    return (rng.integers(steps, size=30) + rng.uniform(0.3, 0.7, 30)) / steps


@pytest.mark.parametrize("tip", [TIP, BESIDE], ids=["tip", "beside"])
@pytest.mark.parametrize("kind", KINDS)
def test_a_thin_wall_between_two_samples_is_found(motions, kind, tip):
    """Thinner than any way between samples; no sample lies in it."""
    motion = motions[kind]
    for fraction in between_samples(motion):
        joints = motion.at(fraction, motion.joints[round(fraction * (len(motion.joints) - 1))])
        middle = se3.transform_points(ARM.forward(joints), np.array([tip.centre_m]))[0]
        wall = Box(tuple(middle - 2e-4), tuple(middle + 2e-4))
        limits = Limits(workspace=EVERYWHERE, keep_out=(wall,), tool=(tip,), arm_radius_m=0.0)
        for sample in motion.joints:
            check_pose(ARM, sample, limits)
        with pytest.raises(InputError, match="the tool enters the keep-out box"):
            check_motion(ARM, motion, limits)


@pytest.mark.parametrize("kind", KINDS)
def test_a_thin_wall_between_two_samples_of_the_arm_is_found(motions, kind, monkeypatch):
    """As above; a line is sampled less densely, or the arm's own thickness would find it."""
    monkeypatch.setattr("hecbench_hardware.motions._LINE_STEP_M", 0.08)
    monkeypatch.setattr("hecbench_hardware.motions._LINE_TURN_RAD", 0.4)
    motion = replace(motions[kind])
    for fraction in between_samples(motion):
        joints = motion.at(fraction, motion.joints[round(fraction * (len(motion.joints) - 1))])
        middle = ARM.forward(joints)[:3, 3]
        wall = Box(tuple(middle - 2e-4), tuple(middle + 2e-4))
        limits = Limits(workspace=EVERYWHERE, keep_out=(wall,), tool=(), arm_radius_m=0.0)
        for sample in motion.joints:
            check_pose(ARM, sample, limits)
        with pytest.raises(InputError, match="the arm enters the keep-out box"):
            check_motion(ARM, motion, limits)


@pytest.mark.parametrize("factor", [0.1, 0.0])
def test_too_small_a_bound_of_the_way_would_be_noticed(motions, factor, monkeypatch):
    """The law above fails when the way between samples is underestimated."""
    travel = JointMotion.travel
    monkeypatch.setattr(
        JointMotion, "travel", lambda self, *given: tuple(factor * way for way in travel(self, *given))
    )
    with pytest.raises(pytest.fail.Exception):
        test_a_thin_wall_between_two_samples_is_found(motions, "joints", TIP)


def truth_m(joints, limits):
    """Smallest distance of the tool's balls and of the arm from the walls over joints (N, 6), by plain loops."""
    frames = ARM.link_frames(joints)
    closest = np.inf
    for ball in limits.tool:
        centres = se3.transform_points(frames[:, 5], np.array([ball.centre_m]))[:, 0]
        inside = np.minimum(centres - limits.workspace.lower_m, limits.workspace.upper_m - centres).min()
        gaps = [np.linalg.norm(np.maximum(np.maximum(box.lower_m - centres, centres - box.upper_m), 0), axis=1).min()
                for box in limits.keep_out]  # fmt: skip
        closest = min(closest, inside - ball.radius_m, *(gap - ball.radius_m for gap in gaps))
    points = body_points(frames)
    for box in limits.keep_out:
        gap = np.linalg.norm(
            np.maximum(np.maximum(box.lower_m - points, points - box.upper_m), 0), axis=2
        ).min()
        closest = min(closest, gap - np.hypot(limits.arm_radius_m, 0.01))
    return closest


@pytest.mark.parametrize("kind", KINDS)
def test_verdict_is_that_of_dense_sampling(motions, kind):
    """Nothing is accepted that touches, and nothing refused that stays clear by more than the resolution."""
    motion, rng = motions[kind], np.random.default_rng(2)
    joints = densely(motion, 801)
    near = ARM.forward(joints)[:, :3, 3]
    verdicts = []
    for _ in range(40):
        centre = near[rng.integers(len(near))] + rng.normal(0, 0.12, 3)
        half = rng.uniform(0.002, 0.05, 3)
        flange_T_tcp = getattr(motion, "flange_T_tcp", np.eye(4))
        limits = Limits(
            workspace=EVERYWHERE,
            keep_out=(Box(tuple(centre - half), tuple(centre + half)),),
            tool=(Sphere((0.0, 0.0, 0.05), 0.03), *tool_line(flange_T_tcp)),
            arm_radius_m=0.03,
        )
        clear_m = truth_m(joints, limits)
        try:
            check_motion(ARM, motion, limits)
            accepted = True
        except InputError:
            accepted = False
        if accepted:
            assert clear_m >= 0
        if clear_m > RESOLUTION_M:
            assert accepted
        verdicts.append(accepted)
    assert 5 < sum(verdicts) < 35


def test_a_long_tool_swings_the_flange_through_a_wall(ready_pose):
    """The tool swings about its tip, head down: the chord of the flange is below the wall, its arc is not."""
    start = ARM.inverse(turned_about(LONG_TOOL, ready_pose, [0.0, -0.5, 0.0]), ready_pose)[0]
    target = turned_about(LONG_TOOL, start, [0.0, 1.0, 0.0])
    line = LineMotion(ARM, start, target, LONG_TOOL)
    top_m = max(ARM.forward(start)[2, 3], target[2, 3]) + 0.01
    assert ARM.forward(line.joints)[:, 2, 3].max() > top_m + 0.02
    limits = Limits(workspace=Box((-9.0, -9.0, -9.0), (9.0, 9.0, top_m)), tool=(SMALL,))
    check_motion(ARM, LineMotion(ARM, start, target), limits)
    with pytest.raises(InputError, match="leaves the workspace"):
        check_motion(ARM, line, limits)


def test_the_tip_of_a_long_tool_counts(ready_pose):
    tip = (ARM.forward(ready_pose + 0.2 * PAN) @ LONG_TOOL)[:3, 3]
    box = Box(tuple(tip - 0.02), tuple(tip + 0.02))
    motion = JointMotion(ARM, ready_pose, ready_pose + 0.4 * PAN)
    limits = Limits(workspace=EVERYWHERE, keep_out=(box,), tool=(SMALL,))
    check_motion(ARM, motion, limits)
    with pytest.raises(InputError, match="the tool enters"):
        check_motion(ARM, motion, replace(limits, tool=tool_line(LONG_TOOL)))


def test_slack_is_kept_from_every_wall(ready_pose):
    flange = ARM.forward(ready_pose)[:3, 3]
    box = Box(tuple(flange - 1.0), tuple(flange + np.array([-0.05, 1.0, 1.0])))
    limits = Limits(workspace=EVERYWHERE, keep_out=(box,), tool=(SMALL,), arm_radius_m=0.001)
    still = JointMotion(ARM, ready_pose, ready_pose)
    check_motion(ARM, still, limits, slack_m=0.03)
    with pytest.raises(InputError, match="enters"):
        check_motion(ARM, still, limits, slack_m=0.06)


@pytest.mark.parametrize("wall", ["workspace", "box"])
@pytest.mark.parametrize(
    ("radius_m", "slack_m", "clear"), [(0.04, 0.0, True), (0.06, 0.0, False), (0.04, 0.02, False)]
)
def test_a_ball_of_the_tool_counts_to_its_surface_and_by_the_slack(
    ready_pose, wall, radius_m, slack_m, clear
):
    """A wall 50 mm from its centre; the arm is far from it."""
    base_T_flange = ARM.forward(ready_pose)
    centre = se3.transform_points(base_T_flange, np.array([TIP.centre_m]))[0]
    outwards = centre - base_T_flange[:3, 3]
    axis = np.argmax(np.abs(outwards))
    away = np.sign(outwards[axis]) * np.eye(3)[axis]
    place = centre + 0.05 * away
    limits = Limits(workspace=EVERYWHERE, tool=(replace(TIP, radius_m=radius_m),), arm_radius_m=0.0)
    if wall == "box":
        limits = replace(limits, keep_out=(Box(tuple(place - 1e-5), tuple(place + 1e-5)),))
    else:
        corners = np.where(away > 0, place, 9.0), np.where(away < 0, place, -9.0)
        limits = replace(limits, workspace=Box(tuple(corners[1]), tuple(corners[0])))
    still = JointMotion(ARM, ready_pose, ready_pose)
    if clear:
        check_motion(ARM, still, limits, slack_m)
    else:
        with pytest.raises(InputError, match="the tool"):
            check_motion(ARM, still, limits, slack_m)


@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
def test_the_balls_of_the_arm_cover_its_links(arm, rng):
    """Every point of a tube around the links from the shoulder to the flange lies in one of them."""
    origins = arm.link_frames(rng.uniform(-2, 2, 6))[:, :3, 3]
    aside = origins[3] - origins[2]
    corners = np.array([origins[0], origins[0] + aside, origins[1] + aside, *origins[1:]])
    balls = body_points(arm.link_frames(np.zeros((1, 6))))
    assert balls.shape[1] > len(corners)
    frames = arm.link_frames(rng.uniform(-2, 2, (20, 6)))
    origins, points = frames[..., :3, 3], body_points(frames)
    aside = origins[:, 3] - origins[:, 2]
    corners = np.stack(
        [origins[:, 0], origins[:, 0] + aside, origins[:, 1] + aside, *origins.swapaxes(0, 1)[1:]], 1
    )
    for k in range(corners.shape[1] - 1):
        on_link = (
            corners[:, k, None]
            + np.linspace(0, 1, 97)[:, None] * (corners[:, k + 1] - corners[:, k])[:, None]
        )
        gaps = np.linalg.norm(on_link[:, :, None] - points[:, None], axis=3).min(2)
        assert gaps.max() <= 0.01 + 1e-9


@pytest.mark.parametrize("gripper", solids.GRIPPERS.values(), ids=solids.GRIPPERS)
def test_the_balls_of_a_gripper_cover_it_and_little_more(gripper, rng):
    balls = gripper.envelope()
    centres, radii = np.array([ball.centre_m for ball in balls]), np.array([ball.radius_m for ball in balls])
    for solid in gripper.solids():
        points = solid.centre_m + rng.uniform(-1, 1, (500, 3)) * solid.half_m + gripper.flange_T_tool[:3, 3]
        assert (np.linalg.norm(points[:, None] - centres, axis=2) - radii).min(1).max() <= 0
    tip_m = gripper.flange_to_tool_m + gripper.tip_below_tool_m
    assert tip_m <= (centres[:, 2] + radii).max() < tip_m + 0.006


def test_the_arm_itself_counts(ready_pose):
    elbow = ARM.link_frames(ready_pose)[1, :3, 3]
    box = Box(tuple(elbow - 0.01), tuple(elbow + 0.01))
    with pytest.raises(InputError, match="the arm enters"):
        check_pose(ARM, ready_pose, Limits(keep_out=(box,)))


def test_every_pose_of_a_motion_counts_for_the_joint_range(ready_pose):
    limits = Limits(joint_upper_rad=(0.5, 7, 7, 7, 7, 7))
    with pytest.raises(InputError, match="joint 1 at"):
        check_motion(ARM, JointMotion(ARM, ready_pose, ready_pose + 0.4 * PAN), limits)


@pytest.mark.parametrize("kind", ["line", "long tool", "turn on the spot", "hardly any shift"])
def test_a_line_is_slowed_until_no_joint_is_too_fast(motions, ready_pose, kind):
    """Driven on the simulated controller at the speed that is asked for; it is not slower than it must be either."""
    turn = [0.3, 0.6, 0.9]
    motions["turn on the spot"] = LineMotion(ARM, ready_pose, turned_about(np.eye(4), ready_pose, turn))
    shifted = turned_about(np.eye(4), ready_pose, turn, [0.001, 0, 0])
    motions["hardly any shift"] = LineMotion(ARM, ready_pose, shifted)
    line = motions[kind]
    driven = SimulatedArm(ARM)
    driven.joints = line.start.copy()
    driven.set_tcp(vector_of(line.flange_T_tcp))
    fastest = [
        np.abs(driven.joint_speeds).max()
        for _ in move_linear(driven, line.base_T_tcp, line.speed_m_s(0.5), 0.5)
    ]
    assert 0.4 < max(fastest) < 0.51
    expected_s = motion_time_s(line.length_m, line.speed_m_s(0.5), 0.5)
    assert len(fastest) * driven.dt_s == pytest.approx(expected_s, abs=0.01)


def test_a_line_to_where_the_arm_is_has_no_speed(ready_pose):
    assert LineMotion(ARM, ready_pose, ARM.forward(ready_pose)).speed_m_s(0.5) > 1e3


def test_a_line_through_a_singularity_is_refused():
    joints = np.array([0.0, -1.2, 1.6, -1.9708, -1.5708, 0.0])
    mirrored = ARM.forward(joints).copy()
    mirrored[:2, 3] *= -1
    with pytest.raises(InputError, match=r"singularity|out of reach"):
        check_motion(ARM, LineMotion(ARM, joints, mirrored), Limits())


def test_six_joints():
    assert six_joints([0, 1, 2, 3, 4, 5]).dtype == float
    for wrong in ([1, 2], [[0] * 6], [0, 0, 0, 0, 0, float("inf")]):
        with pytest.raises(InputError, match="six joint angles"):
            six_joints(wrong)


@pytest.mark.parametrize(("length", "expected_s"), [(0.0, 0.0), (0.25, 1.0), (1.0, 2.5)])
def test_motion_time(length, expected_s):
    """Triangular below the top speed, trapezoidal above."""
    assert motion_time_s(length, 0.5, 1.0) == pytest.approx(expected_s)
