import cv2
import numpy as np
import pytest
from hecbench_plugins.perception.graph import runnable

from hecbench.errors import InputError


def test_what_opencv_cannot_load_is_one_line_that_names_the_file(tmp_path):
    path = tmp_path / "network.onnx"
    with (
        pytest.raises(InputError, match=r"network\.onnx: OpenCV cannot run this graph: ") as refused,
        runnable(path),
    ):
        cv2.dnn.readNetFromONNX(np.frombuffer(b"not a graph", np.uint8))
    assert "\n" not in str(refused.value)


def test_other_faults_are_not_the_graph_s(tmp_path):
    with pytest.raises(KeyError), runnable(tmp_path / "network.onnx"):
        raise KeyError("image")
