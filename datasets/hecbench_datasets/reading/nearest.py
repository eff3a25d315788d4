"""Which known format a folder comes nearest to, and what it lacks of it."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path, PurePosixPath

LAYOUTS: dict[str, tuple[str, ...]] = {
    "native": ("recording.json", "images/*"),
    "easyhec": ("K.txt", "qpos/*.txt", "color/*", "mask/*"),
    "zivid": ("pos*.yaml", "*.zdf"),
    "visp": ("*pose_rPe_*.yaml", "*camera*.xml", "*image-*"),
    "industrial": ("cal_data.yaml", "images/*"),
    "dream": ("_camera_settings.json", "*.rgb.jpg"),
    "baxter": ("ground_truth_data", "pose_*/*.png"),
    "bop": ("scene_camera.json", "scene_gt.json", "rgb/*"),
    "kinhec": ("sequences.parquet",),
    "easy_handeye": ("*.samples",),
    "lerobot": ("meta/info.json", "data/*/*.parquet", "videos/*/*/*.mp4"),
    "ros_bag": ("metadata.yaml", "*.db3"),
    "pose_tables": ("robot.csv", "target.csv"),
}
"""Files of each format as patterns, the telling one first."""


def nearest_format(files: Iterable[Path], folder: Path) -> str | None:
    """In words: the format most of whose files are there, and the first that is not; None when none has a file."""
    names = [PurePosixPath(file.relative_to(folder).as_posix()) for file in files]
    best: tuple[float, str, str] | None = None
    for name, patterns in LAYOUTS.items():
        present = [any(file.match(pattern) for file in names) for pattern in patterns]
        share = sum(present) / len(patterns)
        if any(present) and not all(present) and (best is None or share > best[0]):
            best = share, name, patterns[present.index(False)]
    return best and f"the nearest format is {best[1]}, which lacks {best[2]}"
