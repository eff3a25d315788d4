"""Figures about one recording: the rig in space, residuals, influence, overlays, and how far methods disagree."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from html import escape
from typing import TYPE_CHECKING

import numpy as np

from hecbench import se3
from hecbench.estimate import Estimate
from hecbench.lens import project
from hecbench.recording import Mounting
from hecbench.report.svg import DARK, LIGHT, RED, panel, svg
from hecbench.se3 import Array
from hecbench.storage.evidence import Evidence
from hecbench.workspace import apart_m, points_in_parent

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def residuals_px(evidence: Evidence, estimate: Estimate) -> Array | None:
    """Predicted minus observed corners (N, P, 2) px, NaN where not seen; None when they cannot be predicted."""
    predicted = _predicted_px(evidence, estimate)
    return None if predicted is None or evidence.corners_px is None else predicted - evidence.corners_px


def _predicted_px(evidence: Evidence, estimate: Estimate) -> Array | None:
    camera = estimate.camera or evidence.camera
    X, Y, points_m = estimate.parent_T_camera, estimate.carrier_T_target, evidence.points_m
    if camera is None or camera.K is None or X is None or Y is None or points_m is None:
        return None
    if (hand := evidence.base_T_flange) is None:
        return None
    if evidence.mounting is Mounting.EYE_IN_HAND:
        hand = se3.inverse(hand)
    camera_T_target = se3.inverse(X) @ hand @ Y
    return project(camera, se3.transform_points(camera_T_target, points_m))


def residual_figure(evidence: Evidence, estimate: Estimate) -> str | None:
    """Residuals over the image, and their rms for each sample with the sample's influence on the answer."""
    residuals = residuals_px(evidence, estimate)
    if residuals is None or evidence.corners_px is None or evidence.size is None:
        return None
    figure, axes = panel(10.0, 3.4, columns=2)
    seen = np.isfinite(residuals).all(-1)
    at, by = evidence.corners_px[seen], residuals[seen]
    axes[0].quiver(at[:, 0], at[:, 1], by[:, 0], by[:, 1], angles="xy", color=DARK, width=0.003)
    axes[0].set(xlim=(0, evidence.size[0]), ylim=(evidence.size[1], 0), xlabel="u, px", ylabel="v, px")
    axes[0].set_title(f"{estimate.solver}: residuals over the image (enlarged)", fontsize=10)
    axes[0].set_aspect("equal")
    squares = np.where(seen, (residuals**2).sum(-1), 0).sum(1) / np.maximum(seen.sum(1), 1)
    numbers = np.arange(len(squares))
    axes[1].bar(numbers, np.sqrt(squares), color=LIGHT, label="rms residual, px")
    axes[1].set(xlabel="sample", ylabel="rms residual, px", xlim=(-1, len(squares)))
    if evidence.influence_mm is not None and np.isfinite(evidence.influence_mm).any():
        influence = axes[1].twinx()
        influence.plot(numbers, evidence.influence_mm, "o", color=RED, markersize=3)
        influence.set_ylabel("answer moves without it, mm", color=RED)
        influence.set_ylim(bottom=0)
    axes[1].set_title("residual and influence of each sample", fontsize=10)
    return svg(figure)


def scene_figure(evidence: Evidence, estimate: Estimate) -> str | None:
    """Base, flange, camera and target in space, from the side and from above, with the axes of each frame."""
    X = estimate.parent_T_camera
    if X is None or evidence.base_T_flange is None:
        return None
    base_T_flange = evidence.base_T_flange[np.isfinite(evidence.base_T_flange).all((1, 2))]
    eye_to_hand = evidence.mounting is Mounting.EYE_TO_HAND
    cameras = X[None] if eye_to_hand else base_T_flange @ X
    Y = estimate.carrier_T_target
    targets = np.zeros((0, 4, 4)) if Y is None else base_T_flange @ Y if eye_to_hand else Y[None]
    figure, axes = panel(10.0, 4.2, columns=2)
    for view, (across, up) in zip(axes, ((0, 2), (0, 1)), strict=True):
        for name, frames, colour in (
            ("base", np.eye(4)[None], DARK),
            ("flange", base_T_flange, LIGHT),
            ("target", targets, "#2e8b57"),
            ("camera", cameras, RED),
        ):
            _draw_frames(view, frames, across, up, colour, name)
        view.set_aspect("equal", adjustable="datalim")
        view.set(xlabel=f"{'xyz'[across]} of the base, m", ylabel=f"{'xyz'[up]} of the base, m")
        view.grid(True, alpha=0.25)
    axes[0].set_title("from the side", fontsize=10)
    axes[1].set_title("from above; the long stroke of the camera is its view axis", fontsize=10)
    axes[1].legend(loc="center left", bbox_to_anchor=(1.01, 0.5), frameon=False, fontsize=9)
    return svg(figure)


def _draw_frames(view: Axes, frames: Array, across: int, up: int, colour: str, name: str) -> None:
    """Origins as dots, axes as short strokes; the camera's z axis is drawn longer."""
    lengths = (0.05, 0.05, 0.3 if name == "camera" else 0.05)
    for axis, length in enumerate(lengths):
        ends = frames[:, :3, 3] + length * frames[:, :3, axis]
        strokes = np.stack([frames[:, :3, 3], ends])
        view.plot(strokes[:, :, across], strokes[:, :, up], color=colour, linewidth=0.8, alpha=0.7)
    view.plot(frames[:, across, 3], frames[:, up, 3], ".", color=colour, markersize=4, label=name)


def agreement_figure(evidence: Evidence, estimates: Sequence[Estimate]) -> str | None:
    """Rms displacement of workspace points between the answers of every two methods, mm."""
    answered = [e for e in estimates if e.parent_T_camera is not None]
    if len(answered) < 2 or evidence.base_T_flange is None:
        return None
    points_m = points_in_parent(evidence.base_T_flange, evidence.mounting is Mounting.EYE_IN_HAND)
    answers = np.array([e.parent_T_camera for e in answered])
    apart_mm = 1e3 * apart_m(answers[:, None], answers, points_m)
    figure, (axes,) = panel(2.6 + 0.5 * len(answered), 1.4 + 0.36 * len(answered), columns=1)
    axes.imshow(np.log10(np.maximum(apart_mm, 0.01)), cmap="Blues", vmin=-1, vmax=3)
    names = [e.solver for e in answered]
    axes.set_xticks(range(len(names)), names, rotation=60, ha="right", fontsize=8)
    axes.set_yticks(range(len(names)), names, fontsize=8)
    for i, j in np.ndindex(*apart_mm.shape):
        colour = "white" if apart_mm[i, j] > 30 else "black"
        if i != j:
            axes.text(j, i, _short(float(apart_mm[i, j])), ha="center", va="center", fontsize=7, color=colour)
    axes.set_title("methods apart in the workspace, mm", fontsize=10)
    return svg(figure)


def _short(millimetres: float) -> str:
    return f"{millimetres:.2g}" if millimetres < 99.5 else f"{millimetres:.0f}"


def overlays(evidence: Evidence, estimate: Estimate) -> list[str]:
    """Pictures as SVG: observed corners as rings, predicted ones as crosses."""
    predicted = _predicted_px(evidence, estimate)
    if predicted is None or evidence.size is None or evidence.corners_px is None:
        return []
    width, height = evidence.size
    drawings = []
    for index, jpeg in sorted(evidence.pictures.items()):
        radius, arm = width / 160, width / 220
        marks = [
            f'<circle cx="{u:.2f}" cy="{v:.2f}" r="{radius:.1f}" class="seen"/>'
            for u, v in evidence.corners_px[index] + 0.5
            if np.isfinite(u)
        ] + [
            f'<path d="M{u - arm:.2f} {v:.2f}h{2 * arm:.2f}M{u:.2f} {v - arm:.2f}v{2 * arm:.2f}" class="predicted"/>'
            for u, v in predicted[index] + 0.5
            if np.isfinite(u) and -width < u < 2 * width and -height < v < 2 * height
        ]
        label = escape(
            f"sample {evidence.sample_ids[index]}: rings observed, crosses predicted by {estimate.solver}"
        )
        drawings.append(
            f'<svg class="overlay" viewBox="0 0 {width} {height}" role="img"><title>{label}</title>'
            f'<image width="{width}" height="{height}" href="data:image/jpeg;base64,'
            f'{base64.b64encode(jpeg).decode()}"/>{"".join(marks)}</svg>'
        )
    return drawings
