"""KinHEC's layout, written here with its column names."""

import numpy as np
import pytest
from hecbench_datasets.formats import kinhec

from hecbench import se3
from hecbench.errors import InputError
from hecbench.recording import Mounting

pyarrow = pytest.importorskip("pyarrow")
parquet = pytest.importorskip("pyarrow.parquet")


def columns(prefix, poses):
    rows = np.hstack([poses[:, :3, 3], se3.to_quat_wxyz(poses)])
    return {f"{prefix}_{name}": rows[:, i] for i, name in enumerate(kinhec._POSE)}


@pytest.fixture(params=[True, False], ids=["in_hand", "to_hand"])
def dataset(request, cell, tmp_path):
    robot, target, parent_T_camera = cell(request.param)
    stamps = np.arange(len(robot)) / 10
    offset = 0.05
    measured = columns("cam_target_meas", target)
    measured["cam_target_meas_px"][4] = np.nan
    (tmp_path / "robot").mkdir()
    (tmp_path / "camera").mkdir()
    parquet.write_table(
        pyarrow.table({"t": stamps, **columns("base_ee_meas", robot)}), tmp_path / "robot" / "a.parquet"
    )
    frames = {"frame": np.arange(len(robot)), "t": stamps + offset}
    parquet.write_table(pyarrow.table({**frames, **measured}), tmp_path / "camera" / "a.parquet")
    unused = np.eye(4)[None]
    index = {
        "sequence_id": ["noise-000000"],
        "configuration": ["eye_in_hand" if request.param else "eye_to_hand"],
        "time_offset_s": [offset],
        "scale": [1.0],
        "robot_file": ["robot/a.parquet"],
        "camera_file": ["camera/a.parquet"],
        "robot_row_group": [0],
        "camera_row_group": [0],
        **columns("X", parent_T_camera[None] if request.param else unused),
        **columns("Y", unused if request.param else parent_T_camera[None]),
    }
    parquet.write_table(pyarrow.table(index), tmp_path / "sequences.parquet")
    return tmp_path, request.param, robot, parent_T_camera


def test_a_sequence_with_its_truth(dataset, sniffers):
    root, in_hand, robot, parent_T_camera = dataset
    path = root / "noise-000000"
    assert sniffers(path) == ["kinhec"]
    recording = kinhec.load(path)
    assert recording.mounting is (Mounting.EYE_IN_HAND if in_hand else Mounting.EYE_TO_HAND)
    np.testing.assert_allclose(recording.base_T_flange, np.delete(robot, 4, 0), atol=1e-9)
    np.testing.assert_allclose(recording.truth_parent_T_camera, parent_T_camera, atol=1e-9)


def test_the_root_and_an_unknown_sequence_say_what_there_is(dataset):
    root = dataset[0]
    with pytest.raises(InputError, match=r"holds 1 sequences; name one, such as .*noise-000000"):
        kinhec.load(root)
    with pytest.raises(InputError, match="has no sequence 'noise-1'"):
        kinhec.load(root / "noise-1")


def test_a_damaged_file_is_named(dataset):
    root = dataset[0]
    (root / "camera" / "a.parquet").write_bytes(b"PAR1 and no more")
    with pytest.raises(InputError, match=r"a\.parquet: cannot be read as Parquet"):
        kinhec.load(root / "noise-000000")
