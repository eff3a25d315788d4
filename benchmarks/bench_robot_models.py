"""Arms of other makers before four kinds of background, lit and flat, with exact and ragged masks: TRE of `render_gn`.

The models come from packages that pip can install (``pip install --no-deps --target MODELS example-robot-data jrl``;
BSD-3 and MIT, each model under its maker's licence; nothing of them is kept here) and from airo-models.

Run: ``python benchmarks/bench_robot_models.py matrix|load --models MODELS [--items 3] [--out FILE.json]``.
`matrix` prints, for each cell, the median TRE over the arms with its bootstrap interval, and how many ends were `ok`
above 5 mm; `load` reads every URDF below MODELS. Further packages that hold some: pybullet (without random_urdfs),
mani_skill, icub-models, drake, hello-robot-stretch-urdf, rtb-data, robosuite, reachy_mini and scikit-robot.
"""

import argparse
import json
import time
from collections import Counter
from pathlib import Path

import numpy as np
from hecbench_plugins.solvers.render_gn import render_gn
from scipy import ndimage

from hecbench import se3
from hecbench.errors import HecbenchError, InputError
from hecbench.recording import CameraModel, Mounting, Recording, RobotDescription
from hecbench.rendering import Renderer, RenderMesh
from hecbench.robots.model import load_robot
from hecbench.statistics import bootstrap, wilson
from hecbench.workspace import apart_m, points_in_parent

WIDTH, HEIGHT, FOCAL_PX, VIEWS = 640, 480, 620.0, 5
ROBOTS = "cmeel.prefix/share/example-robot-data/robots"
ARMS = {
    "ur5e": ("ur5e", "tool0"),
    "ur3e": ("ur3e", "tool0"),
    "ur10": (f"{ROBOTS}/ur_description/urdf/ur10_robot.urdf", "tool0"),
    "panda": (f"{ROBOTS}/panda_description/urdf/panda.urdf", "panda_link8"),
    "xarm7": (f"{ROBOTS}/xarm_description/urdf/xarm7.urdf", "link7"),
    "z1": (f"{ROBOTS}/z1_description/urdf/z1.urdf", "link06"),
    "so101": (f"{ROBOTS}/so_arm_description/urdf/so101.urdf", None),
    "kinova": (f"{ROBOTS}/kinova_description/robots/kinova.urdf", None),
    "baxter": (f"{ROBOTS}/baxter_description/urdf/baxter.urdf", "left_hand"),
    "tiago": (f"{ROBOTS}/tiago_description/robots/tiago_no_hand.urdf", "arm_7_link"),
    "fetch": ("jrl/urdfs/fetch/fetch.urdf", "wrist_roll_link"),
    "iiwa7": ("jrl/urdfs/iiwa7/iiwa7.urdf", "iiwa_link_ee"),
}
BACKGROUNDS = ("plain", "mottled", "loud", "gradient")
LIGHTS = ("flat", "lit")
MASKS = ("exact", "ragged")
SUN = np.array([0.4, -0.7, -0.6]) / np.linalg.norm([0.4, -0.7, -0.6])
"""Towards the lamp, in the camera's frame."""
MOTTLING = 5 / 255


def arm(name, models):
    """The model, its base and flange, and the joints between them."""
    source, tip = ARMS[name]
    model = load_robot(source if "/" not in source else models / source)
    by_child = {joint.child: joint for joint in model.joints}
    chains = {}
    for link in model.links:
        chain, at = [], link
        while at in by_child:
            chain.append(by_child[at])
            at = by_child[at].parent
        chains[link] = chain[::-1]
    moving = {link: [j.name for j in chain if j.name in model.joint_names] for link, chain in chains.items()}
    tip = tip if tip in moving else max(model.links, key=lambda link: len(moving[link]))
    return model, model.links[0], tip, tuple(moving[tip])


def background(kind, rng):
    """(H, W, 3) in [0, 1]."""
    plain = np.full((HEIGHT, WIDTH, 3), 0.8) * rng.uniform(0.8, 1.0, 3)
    if kind == "gradient":
        return plain * np.linspace(0.6, 1.1, WIDTH)[None, :, None]
    if kind == "mottled":
        spots = ndimage.gaussian_filter(rng.normal(size=(HEIGHT, WIDTH)), 6)
        return plain + MOTTLING * (spots / spots.std())[..., None]
    if kind == "loud":
        coarse = rng.uniform(0, 1, (HEIGHT // 24, WIDTH // 20, 3))
        return np.kron(coarse, np.ones((24, 20, 1)))[:HEIGHT, :WIDTH]
    return plain


def picture(mesh, K, camera_T_link, scene, lit):
    """A picture by 2x2 samples per pixel, and the exact mask by pixel centres."""
    K2 = K.copy()
    K2[:2] *= 2
    K2[:2, 2] += 0.5
    fine = Renderer(mesh, K2, 2 * WIDTH, 2 * HEIGHT)
    fine.draw(camera_T_link)
    colours = np.clip(mesh.colours, 0.02, 1.0)[np.maximum(fine.part, 0)]
    if lit:
        normals = np.einsum(
            "fij,fj->fi", camera_T_link[mesh.part_link[mesh.face_part], :3, :3], mesh.planes[:3].T
        )
        shade = 0.35 + 0.65 * np.maximum(normals @ SUN, 0)
        colours = colours * shade[np.maximum(fine.face, 0)][..., None]
    large = np.where((fine.face >= 0)[..., None], colours, np.kron(scene, np.ones((2, 2, 1))))
    image = large.reshape(HEIGHT, 2, WIDTH, 2, 3).mean((1, 3))
    exact = Renderer(mesh, K, WIDTH, HEIGHT)
    exact.draw(camera_T_link)
    return np.round(255 * np.clip(image, 0, 1)).astype(np.uint8), exact.face >= 0


def ragged(mask, rng):
    """A mask whose contour strays by one to three px, here out and there in."""
    stray = ndimage.gaussian_filter(rng.normal(size=mask.shape), 8)
    stray *= rng.uniform(1, 3) / np.abs(stray).std() / 1.5
    signed = ndimage.distance_transform_edt(~mask) - ndimage.distance_transform_edt(mask)
    return signed < stray


def recording(name, models, cell, seed):
    """One item: five views of an arm by a fixed camera, and a start 3-5 cm and 5 deg off per metre of reach."""
    scene_kind, light, masking = cell
    rng = np.random.default_rng([seed, sorted(ARMS).index(name)])
    model, base, tip, names = arm(name, models)
    mesh = RenderMesh.of(model)
    lower, upper = np.clip(model.limits(names), -np.pi, np.pi).T
    joints = (lower + upper) / 2 + rng.uniform(-0.25, 0.25, (VIEWS, len(names))) * (upper - lower)
    base_T_link = model.link_poses(joints, names, frame=base)
    corners = np.concatenate(
        [
            se3.transform_points(pose[model.link_index(part.link)], part.vertices[::50])
            for part in model.parts
            for pose in base_T_link
        ]
    )
    low, high = np.percentile(corners, (1, 99), axis=0)
    middle, size = (low + high) / 2, float(np.linalg.norm(high - low))
    side = rng.uniform(-0.6, 0.6)
    eye = middle + 1.15 * size * np.array([np.cos(side), np.sin(side), rng.uniform(0.1, 0.5)])
    forward = (middle - eye) / np.linalg.norm(middle - eye)
    right = np.cross(forward, [0, 0, 1])
    right /= np.linalg.norm(right)
    base_T_camera = se3.make(np.stack([right, np.cross(forward, right), forward], 1), eye)
    K = np.array([[FOCAL_PX, 0, WIDTH / 2 - 0.5], [0, FOCAL_PX, HEIGHT / 2 - 0.5], [0, 0, 1]])
    scene = background(scene_kind, rng)
    drawn = [
        picture(mesh, K, se3.inverse(base_T_camera) @ pose, scene, light == "lit") for pose in base_T_link
    ]
    masks = [mask if masking == "exact" else ragged(mask, rng) for _, mask in drawn]
    turn = rng.normal(size=3)
    move = rng.normal(size=3)
    off = np.r_[np.deg2rad(4) * turn / np.linalg.norm(turn), 0.04 * size * move / np.linalg.norm(move)]
    source = ARMS[name][0]
    described = {"model": source} if "/" not in source else {"urdf": models / source}
    return Recording(
        name=f"{name}_{'_'.join(cell)}",
        mounting=Mounting.EYE_TO_HAND,
        sample_ids=tuple(map(str, range(VIEWS))),
        robot=RobotDescription(base_link=base, flange_link=tip, joint_names=names, **described),
        camera=CameraModel(WIDTH, HEIGHT, K),
        initial_parent_T_camera=base_T_camera @ se3.make(se3.so3_exp(off[:3]), off[3:]),
        truth_parent_T_camera=base_T_camera,
        base_T_flange=base_T_link[:, model.link_index(tip)],
        joints_rad=joints,
        images=tuple(image for image, _ in drawn),
        masks=tuple(np.uint8(255) * mask for mask in masks),
    )


def run(item):
    """TRE in mm (inf without an answer), the stage that answered or the reason, seconds of CPU."""
    began = time.process_time()
    try:
        found = render_gn()(item.without_truth(), rng=np.random.default_rng(0))
    except HecbenchError as error:
        return np.inf, str(error)[:60], time.process_time() - began
    workspace = points_in_parent(item.base_T_flange, camera_moves=False)
    tre_mm = 1e3 * float(apart_m(found.parent_T_camera, item.truth_parent_T_camera, workspace))
    return tre_mm, found.diagnostics["stage"], time.process_time() - began


def matrix(options):
    """Every cell on every arm that is there."""
    cells = [(b, light, masks) for masks in MASKS for light in LIGHTS for b in BACKGROUNDS]
    arms = [n for n, (source, _) in ARMS.items() if "/" not in source or (options.models / source).is_file()]
    arms = [name for name in arms if not options.arm or name in options.arm]
    print(f"{len(arms)} arms, {options.items} items each, {VIEWS} views: {', '.join(arms)}")
    rows = []
    for cell in cells:
        results = []
        for name in arms:
            for seed in range(options.items):
                try:
                    item = recording(name, options.models, cell, seed)
                except InputError as error:
                    print(f"{name}: {error}")
                    break
                results.append((name, *run(item)))
        errors = np.array([row[1] for row in results])
        answered = np.isfinite(errors)
        shown = np.where(answered, errors, 1e6)
        interval = bootstrap(shown, np.median)
        wrong = wilson(int((errors[answered] > 5).sum()), len(errors))
        print(
            f"{'/'.join(cell):24s} n {len(errors)}"
            f"  median {np.median(shown):7.2f} [{interval.low:.2f}, {interval.high:.2f}]"
            f"  mean {errors[answered].mean() if answered.any() else np.nan:6.2f}  ok {answered.sum()}"
            f"  ok>5mm {int((errors[answered] > 5).sum())} [{wrong.low:.2f}, {wrong.high:.2f}]"
            f"  {dict(Counter(row[2] for row in results))}  {np.mean([row[3] for row in results]):.1f} s",
            flush=True,
        )
        for row in results:
            if not row[1] < 5:
                print("    ", row[0], f"{row[1]:.1f}", row[2])
        rows.append({"cell": cell, "results": results})
        if options.out:
            options.out.write_text(json.dumps(rows, default=float))


def load(options):
    """Read every URDF: how many load, and what is said about the others."""
    loaded = refused = 0
    for file in sorted(options.models.rglob("*.urdf")):
        try:
            model = load_robot(file)
            loaded += 1
            print(
                f"ok      {file.name}: {len(model.joint_names)} joints, {len(model.parts)} parts; {model.notes[:1]}"
            )
        except InputError as error:
            refused += 1
            print(f"refused {error}")
    print(f"{loaded} loaded, {refused} refused")


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("what", choices=["matrix", "load"])
    parser.add_argument("--models", type=Path, required=True)
    parser.add_argument("--items", type=int, default=3)
    parser.add_argument("--arm", action="append")
    parser.add_argument("--out", type=Path)
    chosen = parser.parse_args()
    {"matrix": matrix, "load": load}[chosen.what](chosen)
