"""The segmenter, the translator and the solver that the network serves."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from hecbench_plugins.maskless.solver import Maskless
from hecbench_plugins.perception import choice
from hecbench_plugins.perception.keypoint_pose import Sightings, consensus, independent, refined
from hecbench_plugins.segmenters.learned import Learned
from hecbench_plugins.solvers.keypoints import Keypoints
from hecbench_plugins.translators.learned import Learned as Translator

from hecbench import registry, se3
from hecbench.errors import InputError, Refusal, SolverFailure
from hecbench.recording import CameraModel, Mounting, Recording, RobotDescription
from hecbench.robots.posed import PosedRobot
from hecbench.specs import Kind, SegmenterSpec, SolverSpec, TranslatorSpec
from hecbench.storage import recording_io

CAMERA = CameraModel(640, 480, np.array([[600.0, 0, 320], [0, 600, 240], [0, 0, 1]]))
LOCAL = np.random.default_rng(1).normal(0, 0.05, (10, 3))


@pytest.fixture
def lit(shared):
    return recording_io.load(shared / "data" / "lit_ur5e_1_00")


@dataclass
class Exact:
    """A perceiver that sees keypoints where they are; the picture's first value is the number of the sample."""

    recording: Recording
    noise_px: float = 0.0
    wrong: float = 0.0
    trusted: float = 0.9

    def keypoint_positions(self, robot, links, frame_T_link):
        poses = frame_T_link[..., -10:, :, :]
        return (poses[..., :3, :3] @ LOCAL[..., None])[..., 0] + poses[..., :3, 3]

    def see(self, image):
        sample = int(image[0, 0, 0])
        rng, posed = np.random.default_rng(sample), PosedRobot.of(self.recording, meshes=False)
        points = self.keypoint_positions("", (), posed.link_poses(posed.joints_rad[sample]))
        p = se3.transform_points(se3.inverse(self.recording.truth_parent_T_camera), points)
        pixels = p[:, :2] / p[:, 2:] * 600 + [320, 240] + rng.normal(0, self.noise_px, (10, 2))
        bad = rng.random(10) < self.wrong
        pixels[bad] = rng.uniform(0, 400, (bad.sum(), 2))
        return type("Sight", (), {"keypoints": pixels, "trust": np.full(10, self.trusted)})()


def drawn(mounting, count=12):
    rng = np.random.default_rng(3)
    joints = np.array([0.3, -1.2, 1.3, -1.4, -1.2, 0.3]) + rng.uniform(-0.6, 0.6, (count, 6))
    view = np.array([[0, 0, -1], [1, 0, 0], [0, -1, 0]], float)  # looks along -x
    truth = (
        se3.make(view, [1.8, 0.05, 0.4])
        if mounting is Mounting.EYE_TO_HAND
        else se3.make(np.eye(3), [0, 0, -2.0])
    )
    return Recording(
        name="drawn",
        mounting=mounting,
        sample_ids=tuple(map(str, range(count))),
        robot=RobotDescription(model="ur5e", base_link="base_link"),
        camera=CAMERA,
        truth_parent_T_camera=truth,
        joints_rad=joints,
        images=tuple(np.full((480, 640, 3), i, np.uint8) for i in range(count)),
    )


def solved(monkeypatch, recording, **faults):
    monkeypatch.setattr(choice, "perceiver_for", lambda *arguments: Exact(recording, **faults))
    return Keypoints()(recording, rng=np.random.default_rng(0))


@pytest.mark.parametrize("mounting", list(Mounting))
def test_exact_keypoints_give_the_camera_in_both_mountings(monkeypatch, mounting):
    recording = drawn(mounting)
    estimate = solved(monkeypatch, recording, wrong=0.4)
    np.testing.assert_allclose(estimate.parent_T_camera, recording.truth_parent_T_camera, atol=1e-6)
    assert estimate.diagnostics["agreeing_share"] == pytest.approx(0.6, abs=0.15)


def test_too_few_or_contradicting_keypoints_are_no_answer(monkeypatch):
    recording = drawn(Mounting.EYE_TO_HAND)
    with pytest.raises(Refusal, match="0 keypoints are trusted in 12 images"):
        solved(monkeypatch, recording, trusted=0.1)
    with pytest.raises(Refusal, match="10 keypoints are trusted in 1 images"):
        solved(monkeypatch, recording.subset([0]))
    with pytest.raises(SolverFailure, match="agree on a camera"):
        solved(monkeypatch, recording, wrong=0.95)


def test_the_covariance_is_that_of_the_errors():
    truth = se3.make(se3.so3_exp([1.6, 0.3, -0.2]), [0.1, 0.2, 2.0])
    normalised = []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        points = rng.uniform(-0.5, 0.5, (200, 3))
        p = se3.transform_points(truth, points)
        rays = p[:, :2] / p[:, 2:] + rng.normal(0, 0.002, (200, 2))
        seen = Sightings(points, rays, np.tile(np.arange(10), 20), np.repeat(np.arange(20), 10), np.ones(200))
        answer = refined(seen, consensus(seen, 0.02, 100, rng), 0.02)
        error = se3.log(se3.inverse(truth) @ se3.inverse(answer.parent_T_camera))
        normalised.append(error @ np.linalg.solve(answer.covariance, error))
    assert 4 < np.median(normalised) < 12  # chi-square of 6: 5.3; 20 clusters make it a little larger


def test_the_photographs_refine_what_the_keypoints_found(lit):
    spec = registry.load().get(Kind.SOLVER, "keypoints", SolverSpec)
    blind = replace(lit.without_truth(), initial_parent_T_camera=None, masks=None)
    estimate = spec.factory()(blind, rng=np.random.default_rng(0))
    assert estimate.diagnostics["refined"] == "by the photographs"
    assert estimate.diagnostics["keypoint_kinds"] >= 4
    assert se3.translation_error_m(lit.truth_parent_T_camera, estimate.parent_T_camera) < 0.005
    rough = spec.configured({"refine": "no"}).factory()(blind, rng=np.random.default_rng(0))
    assert "refined" not in rough.diagnostics
    assert se3.translation_error_m(lit.truth_parent_T_camera, rough.parent_T_camera) < 0.15


def test_photographs_that_confirm_nothing_leave_the_answer_of_the_keypoints(lit, monkeypatch):
    def unsure(self, recording, *, rng):
        raise SolverFailure("the photographs confirm 3 % of the contour")

    monkeypatch.setattr(Maskless, "__call__", unsure)
    refined, rough = (
        Keypoints(refine=refine)(lit.without_truth(), rng=np.random.default_rng(0))
        for refine in (True, False)
    )
    assert refined.diagnostics["refined"] == "no: the photographs confirm 3 % of the contour"
    np.testing.assert_array_equal(refined.parent_T_camera, rough.parent_T_camera)


def test_a_point_that_stands_still_counts_once():
    points = np.array([[0, 0, 0.0], [0, 0, 0.01], [1, 0, 0], [0, 0, 0]])
    seen = Sightings(points, np.zeros((4, 2)), np.array([0, 0, 0, 1]), np.array([5, 6, 7, 5]), np.ones(4))
    found = independent(seen)
    np.testing.assert_array_equal(found.weight, [0.5, 0.5, 1, 1])
    assert found.cluster[0] == found.cluster[1] != found.cluster[2]
    assert list(found.cluster[2:]) == [7, 5]


def test_masks_of_every_image_and_a_note_where_there_is_no_robot(lit):
    noise = np.random.default_rng(0).integers(0, 255, (480, 640, 3)).astype(np.uint8)
    spoilt = replace(lit, images=(*lit.images[:-1], noise))
    found = Learned()(spoilt)
    overlaps = []
    for i in range(len(lit) - 1):
        mask, truth = found.mask(i), lit.mask(i)
        overlaps.append((mask & truth).sum() / (mask | truth).sum())
    assert np.mean(overlaps) > 0.92
    assert not found.mask(len(lit) - 1).any()
    assert found.notes[-1].endswith(f"in 1 of {len(lit)} images: {lit.sample_ids[-1]}")
    with pytest.raises(Refusal, match="no robot is seen in any of the 5 images"):
        Learned()(replace(lit, images=(noise,) * len(lit)))


def test_a_robot_that_no_network_knows_is_refused(lit):
    other = replace(lit, robot=replace(lit.robot, model="panda"))
    with pytest.raises(Refusal, match=r"no network for panda is installed \(ur3e, ur5e\)"):
        Learned()(other)
    with pytest.raises(Refusal, match="no network for panda"):
        Keypoints()(other, rng=np.random.default_rng(0))
    with pytest.raises(InputError, match="does not exist"):
        Learned("no/such/folder")(lit)


def test_options_by_name():
    known = registry.load()
    spec = known.get(Kind.SEGMENTER, "learned[model=ur]", SegmenterSpec)
    assert spec.name == "learned[model=ur]"
    assert spec.factory().model == "ur"
    assert known.get(Kind.TRANSLATOR, "learned[model=ur]", TranslatorSpec).factory().model == "ur"
    with pytest.raises(InputError, match="segmenter 'learned' has no option 'modle'"):
        known.get(Kind.SEGMENTER, "learned[modle=ur]", SegmenterSpec)


def test_the_translated_picture_has_the_colours_of_the_model(lit):
    mask = lit.mask(0).astype(np.float32)
    image = lit.image(0).astype(np.float32) / 255
    found = Translator()(image, mask, part=np.full(mask.shape, -1, np.int32), colours=np.zeros((1, 3)))
    from hecbench.rendering import Renderer, RenderMesh

    posed = PosedRobot.of(lit)
    renderer = Renderer(RenderMesh.of(posed.model), lit.camera.K, 640, 480)
    renderer.draw(se3.inverse(lit.truth_parent_T_camera) @ posed.link_poses(posed.joints_rad)[0])
    drawn = renderer.image()[..., :3]
    assert not found[mask == 0].any()
    assert ((found - drawn) ** 2).mean() < 0.5 * ((image * mask[..., None] - drawn) ** 2).mean()
