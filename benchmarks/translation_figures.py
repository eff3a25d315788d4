"""The paper's Table III: translated pictures against the robot drawn at the true camera, on recordings with masks.

Run: ``python benchmarks/translation_figures.py RECORDING... --translator NAME... --out FILE.json``. No picture of these
recordings was trained on. MSE and MAE are of 255, over the whole picture; PSNR and SSIM (11 x 11, sigma 1.5) are means
over the pictures; IoU is that of what is not black.
"""

import argparse
import json
from pathlib import Path

import cv2
import figures_file
import numpy as np

from hecbench import registry, se3
from hecbench.preparation import load_recording, prepare
from hecbench.rendering import Renderer, RenderMesh
from hecbench.robots.posed import PosedRobot
from hecbench.specs import Kind, TranslatorSpec
from hecbench.statistics import bootstrap

BLACK = 0.05
COLUMNS = ("mse", "mae", "iou", "psnr", "ssim")


def ssim(a, b):
    """Mean structural similarity of (H, W, 3) in [0, 1] (Wang et al. 2004)."""

    def blurred(x):
        return cv2.GaussianBlur(x, (11, 11), 1.5)

    ma, mb = blurred(a), blurred(b)
    va, vb, cov = blurred(a * a) - ma * ma, blurred(b * b) - mb * mb, blurred(a * b) - ma * mb
    first, second = 0.01**2, 0.03**2
    found = (2 * ma * mb + first) * (2 * cov + second) / ((ma * ma + mb * mb + first) * (va + vb + second))
    return float(found.mean())


def row(found, drawn):
    off = 255 * (found.astype(float) - drawn)
    mse = float((off**2).mean())
    here, there = (picture.max(2) > BLACK for picture in (found, drawn))
    return (
        mse,
        float(np.abs(off).mean()),
        float((here & there).sum() / max(1, (here | there).sum())),
        float(10 * np.log10(255**2 / max(mse, 1e-9))),
        ssim(found.astype(np.float32), drawn.astype(np.float32)),
    )


def rows(recording, translate):
    recording = prepare(recording)
    posed, camera = PosedRobot.of(recording), recording.camera
    renderer = Renderer(RenderMesh.of(posed.model), camera.K, camera.width, camera.height)
    camera_T_parent = se3.inverse(recording.truth_parent_T_camera)
    found = []
    for sample, poses in zip(posed.samples, posed.link_poses(posed.joints_rad[posed.samples]), strict=True):
        renderer.draw(camera_T_parent @ poses)
        drawn = renderer.image()[..., :3].copy()
        image = recording.image(sample).astype(np.float32) / 255
        mask = recording.mask(sample).astype(np.float32)
        made = translate(image, mask, part=renderer.part, colours=renderer.mesh.colours)
        found.append(row(made, drawn))
    return found


def main():
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("recordings", nargs="+", type=Path)
    options.add_argument("--translator", action="append", required=True)
    options.add_argument("--name", required=True, help="of the group of recordings")
    options.add_argument("--out", type=Path, required=True)
    o = options.parse_args()
    recordings = [load_recording(path) for path in o.recordings]
    found, version = {}, figures_file.version()
    for name in o.translator:
        translate = registry.load().get(Kind.TRANSLATOR, name, TranslatorSpec).factory()
        values = np.array([line for recording in recordings for line in rows(recording, translate)])
        figures = {"n": len(values)}
        for column, numbers in zip(COLUMNS, values.T, strict=True):
            interval = bootstrap(numbers)
            figures[column] = [round(v, 4) for v in (interval.value, interval.low, interval.high)]
        shown, _, model = name.rstrip("]").partition("[model=")
        figures |= {"command": figures_file.command(), **version}
        if model:
            card = json.loads((Path(model) / "model.json").read_text())
            figures["trained"] = f"{card.get('size', '')} px, {card.get('steps', '')} steps"
        found[f"{o.name}, {shown}"] = figures
        print(shown, {column: figures[column] for column in COLUMNS})
    figures_file.replace(o.out, found)


if __name__ == "__main__":
    main()
