"""Whatever is done to other people's files, the answer is a recording or one line that names the place."""

import shutil

import numpy as np
import pytest

from hecbench import registry
from hecbench.errors import InputError
from hecbench.specs import DatasetSpec, Kind

FOLDERS = {
    "camodocal_ur": "opencv_yaml",
    "franka_charuco": "franka_charuco",
    "visp_franka/data-eye-in-hand": "visp",
    "visp_franka/data-eye-to-hand": "visp",
    "industrial_10x10/test_set_10x10": "industrial",
    "ctrnet_baxter": "ctrnet",
}
MUTATIONS = 12


def damage(content, rng):
    """Cut, overwrite, repeat or drop a piece of the bytes."""
    start, stop = np.sort(rng.integers(0, len(content) + 1, 2)).tolist()
    stop = min(stop, start + int(rng.integers(1, 40)))
    noise = bytes(rng.choice(list(b"0.-e[]{}:,\n \x00\xff#&*!nan"), stop - start).tolist())
    return [content[:start], content[:start] + noise + content[stop:], content[:start] + content[stop:]][
        rng.integers(3)
    ]


@pytest.mark.parametrize("folder", FOLDERS)
def test_damaged_files_end_in_one_line(data, tmp_path, rng, folder):
    spec = registry.load().get(Kind.DATASET, FOLDERS[folder], DatasetSpec)
    copy = tmp_path / "eye-in-hand"
    ignored = shutil.ignore_patterns("*.png")
    shutil.copytree(data / folder, copy, ignore=ignored, copy_function=shutil.copyfile)
    if folder == "ctrnet_baxter":
        shutil.copyfile(data / folder / "baxter.png", copy / "baxter.png")
    files = [
        path for path in sorted(copy.rglob("*")) if path.suffix in (".yml", ".yaml", ".json", ".xml", ".md")
    ]
    for _ in range(MUTATIONS):
        file = files[rng.integers(len(files))]
        original = file.read_bytes()
        file.write_bytes(damage(original, rng))
        spec.sniff(copy)
        complaint = None
        try:
            spec.load(copy)
        except InputError as error:
            complaint = str(error)
        assert complaint is None or (str(copy) in complaint and "\n" not in complaint)
        file.write_bytes(original)
