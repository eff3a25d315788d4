"""Photographs through an answer: the robot without a target, a target without a robot, damaged files."""

import io
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from hecbench import preparation, registry
from hecbench.report import pictures
from hecbench.running import solving
from hecbench.specs import Kind, SolverSpec, SuiteSpec


@pytest.fixture(scope="module")
def recording():
    suite = registry.load().get(Kind.SUITE, "photographs", SuiteSpec)
    return preparation.prepare(suite.make("ur3e", 0, 0)).subset([0, 4, 8])


@pytest.fixture(scope="module")
def estimate(recording):
    spec = registry.load().get(Kind.SOLVER, "bundle_fixed", SolverSpec)
    suite = registry.load().get(Kind.SUITE, "photographs", SuiteSpec)
    return solving.solve(suite.make("ur3e", 0, 0), [spec], solving.Options(held_out=False))[0]


def red(path):
    """Pixels as red as a contour."""
    picture = np.asarray(Image.open(io.BytesIO(path.read_bytes())).convert("RGB"), int)
    return int(((picture[..., 0] > 180) & (picture[..., 1:].max(-1) < 110)).sum())


def test_the_robot_is_drawn_without_a_target_where_its_model_is_known(recording, estimate, tmp_path):
    bare = replace(recording, target=None, corners_px=None, camera_T_target=None)
    answer = replace(estimate, carrier_T_target=None)
    drawn = pictures.write(bare, answer, tmp_path / "drawn")
    plain = pictures.write(replace(bare, robot=None, joints_rad=None), answer, tmp_path / "plain")
    assert [path.stem for path in drawn] == [path.stem for path in plain] == list(recording.sample_ids)
    assert min(red(path) - red(other) for path, other in zip(drawn, plain, strict=True)) > 200


def test_damaged_images_and_old_pictures_go(recording, estimate, tmp_path):
    pictures.write(recording, estimate, tmp_path)
    (tmp_path / "damaged.jpg").write_bytes(b"no picture")
    images = (recording.images[0], tmp_path / "damaged.jpg", None)
    written = pictures.write(replace(recording, images=images), estimate, tmp_path)
    assert [path.stem for path in written] == [recording.sample_ids[0]]
    assert list(pictures.load(tmp_path)) == [recording.sample_ids[0]]


def test_without_images_there_are_no_pictures(recording, estimate, tmp_path):
    assert pictures.write(replace(recording, images=None), estimate, tmp_path) == []
