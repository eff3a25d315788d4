"""ViSP's eye-in-hand and eye-to-hand folders; what the images show is tested with the detector."""

import numpy as np
import pytest
from hecbench_datasets.formats import visp

from hecbench.errors import InputError
from hecbench.recording import Mounting
from hecbench.targets import ANY_TAG, AprilTagTarget, ChessboardTarget

FOLDERS = {
    "data-eye-in-hand": (Mounting.EYE_IN_HAND, ChessboardTarget(9, 6, 0.0236)),
    "data-eye-to-hand": (Mounting.EYE_TO_HAND, AprilTagTarget("tag36h11", ANY_TAG, 0.048)),
}


@pytest.mark.parametrize("name", FOLDERS)
def test_both_folders(data, sniffers, name):
    folder = data / "visp_franka" / name
    assert sniffers(folder) == ["visp"]
    recording = visp.load(folder)
    assert (recording.mounting, recording.target) == FOLDERS[name]
    assert (recording.camera.width, recording.camera.height) == (640, 480)
    np.testing.assert_allclose(recording.camera.K[:2, 2], [323.46282958984375, 243.25529479980469])
    assert all(
        image.stem.endswith(f"-{i}") for i, image in zip(recording.sample_ids, recording.images, strict=True)
    )
    assert recording.offers() >= {"images", "intrinsics"}


def pose(path, number=1):
    rows = "\n".join(f"  - [{value}]" for value in (0.3, 0.0, 0.3, -3.0, 0.0, -0.4))
    (path / f"franka_pose_rPe_{number}.yaml").write_text(f"rows: 6\ncols: 1\ndata:\n{rows}\n")


def test_an_unknown_mounting_is_asked_for_and_taken_from_the_hints(tmp_path):
    pose(tmp_path)
    with pytest.raises(InputError, match="eye-in-hand"):
        visp.load(tmp_path)
    (tmp_path / "hecbench-import.yaml").write_text(
        "mounting: eye_in_hand\ntarget: {kind: apriltag, family: tag36h11, id: 3, size_m: 0.1}\n"
    )
    recording = visp.load(tmp_path)
    assert recording.mounting is Mounting.EYE_IN_HAND
    assert recording.target == AprilTagTarget("tag36h11", 3, 0.1)


@pytest.mark.parametrize(
    ("hints", "message"),
    [
        ("mounting: on_the_hand\n", "Invalid enum value 'on_the_hand'"),
        ("mountin: eye_in_hand\n", "unknown field `mountin`"),
        ("mounting: eye_in_hand\ntarget: {kind: charuco, rows: 5}\n", "target: "),
        ("mounting: eye_in_hand\ntarget: {kind: tagboard}\n", "use chessboard, charuco"),
        (
            "mounting: eye_in_hand\ntarget: {kind: chessboard, columns: 1, rows: 5, square_m: 0.1}\n",
            "target.columns: 1",
        ),
    ],
)
def test_wrong_hints_are_named(tmp_path, hints, message):
    pose(tmp_path)
    (tmp_path / "hecbench-import.yaml").write_text(hints)
    with pytest.raises(InputError, match=message) as caught:
        visp.load(tmp_path)
    assert "hecbench-import.yaml" in str(caught.value)


@pytest.mark.parametrize("xml", ["<root><camera>", "<root><px>many</px></root>"])
def test_a_damaged_camera_file_is_named(tmp_path, xml):
    folder = tmp_path / "eye-in-hand"
    folder.mkdir()
    pose(folder)
    (folder / "camera.xml").write_text(xml)
    with pytest.raises(InputError, match=r"camera\.xml"):
        visp.load(folder)
