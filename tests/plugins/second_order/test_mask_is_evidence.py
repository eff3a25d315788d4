"""A given mask is evidence: colours that explain it worse than its own end do not have the last word."""

from dataclasses import replace

import numpy as np
import pytest
from hecbench_datasets.suites import synthetic
from hecbench_plugins.second_order.descent import Trace
from hecbench_plugins.second_order.flatness import unevenness
from hecbench_plugins.second_order.photometry import Photometry
from hecbench_plugins.second_order.settings import STAGES
from hecbench_plugins.solvers.render_gn import render_gn
from hecbench_plugins.views.pyramid import prepare
from scipy import ndimage

from hecbench import se3
from hecbench.robots.posed import PosedRobot
from hecbench.storage import recording_io
from hecbench.workspace import apart_m, points_in_parent


def tre_mm(recording, estimate):
    flange = PosedRobot.of(recording, meshes=False).base_T_flange
    points = points_in_parent(flange, camera_moves=False)
    return 1e3 * float(apart_m(estimate.parent_T_camera, recording.truth_parent_T_camera, points))


def solve(recording):
    return render_gn()(recording.without_truth(), rng=np.random.default_rng(0))


def test_a_lit_arm_with_exact_masks(shared):
    recording = recording_io.load(shared / "cases" / "robot" / "perfect_masks_made_worse_by_the_picture")
    estimate = solve(recording)
    assert estimate.diagnostics["stage"] == "intervals"
    assert tre_mm(recording, estimate) < 1.0
    twist = se3.log(recording.truth_parent_T_camera @ se3.inverse(estimate.parent_T_camera))
    assert np.abs(twist[3:]).max() < 20 * np.sqrt(np.diag(estimate.covariance)[3:]).max()


def _shaded(recording, change):
    return replace(
        recording,
        images=tuple(
            np.uint8(np.clip(change(recording.image(i) / 255.0, recording.mask(i)[..., None]), 0, 1) * 255)
            for i in range(len(recording))
        ),
    )


def _lit(image, mask):
    return np.where(mask, image * np.linspace(0.3, 1.6, image.shape[1])[None, :, None], 0.9)


def _mottled(image, mask):
    spots = ndimage.gaussian_filter(np.random.default_rng(1).normal(size=image.shape[:2]), 6)
    return np.where(mask, image, 0.75 + 5 / 255 * (spots / spots.std())[..., None])


@pytest.mark.parametrize("change", [_lit, _mottled])
def test_uneven_pictures_do_not_move_the_end_of_exact_masks(change):
    recording = synthetic.make("views_3", 1, 3)
    by_masks = solve(replace(recording, images=None))
    estimate = solve(_shaded(recording, change))
    assert tre_mm(recording, estimate) < max(1.0, 1.5 * tre_mm(recording, by_masks))


@pytest.mark.parametrize(("change", "flat"), [(lambda i, m: i, True), (_lit, False)])
def test_shading_is_measured_against_noise(change, flat):
    recording = synthetic.make("noise", 2, 3)
    _, views = prepare(_shaded(recording, change))
    photometry = Photometry(views, 1, slice(0, 3), 0.3, Trace())
    photometry(se3.inverse(recording.truth_parent_T_camera))
    assert (unevenness(photometry) <= STAGES.most_uneven) == flat
