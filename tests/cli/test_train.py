"""``hecbench train`` refuses in one line."""

import pytest

pytest.importorskip("torch", reason="training needs the extra torch")


def test_bad_options(hecbench, refused, tmp_path):
    refused(
        hecbench("train", "perception", "--robot", "no.urdf", "--out", tmp_path), "no such URDF", "no.urdf"
    )
    refused(hecbench("train", "perception", "--robot", "ur5e", "--out", tmp_path, "--hours", 0), "--hours")
    refused(
        hecbench("train", "regression", "--robot", "ur5e", "--out", tmp_path, "--sketches", -1), "--sketches"
    )
