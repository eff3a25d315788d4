"""The adapter of Segment Anything, with stand-in graphs that have its inputs and outputs."""

import numpy as np
import pytest
from hecbench_plugins.segmenters.sam import SegmentAnything, _points

from hecbench.errors import InputError, Refusal
from hecbench.storage import recording_io

onnx = pytest.importorskip("onnx")
pytest.importorskip("onnxruntime")

from onnx import TensorProto, helper  # noqa: E402


def graph(path, nodes, inputs, outputs, constants=()):
    values = [helper.make_tensor_value_info(name, TensorProto.FLOAT, shape) for name, shape in inputs.items()]
    results = [helper.make_tensor_value_info(name, TensorProto.FLOAT, None) for name in outputs]
    made = helper.make_graph(nodes, "stand-in", values, results, list(constants))
    model = helper.make_model(made, opset_imports=[helper.make_opsetid("", 17)], ir_version=9)
    path.write_bytes(model.SerializeToString())
    return str(path)


@pytest.fixture
def encoder(tmp_path):
    """Means of 16 x 16 px."""
    nodes = [
        helper.make_node("AveragePool", ["image"], ["embedding"], kernel_shape=[16, 16], strides=[16, 16])
    ]
    return graph(tmp_path / "encoder.onnx", nodes, {"image": [1, 3, 1024, 1024]}, ["embedding"])


@pytest.fixture
def decoder(tmp_path):
    """Puts the mask prompt, without what was filled up, back into the image; uses every input."""
    constants = [
        helper.make_tensor("longest", TensorProto.FLOAT, [1], [256.0]),
        helper.make_tensor("zero", TensorProto.INT64, [4], [0, 0, 0, 0]),
        helper.make_tensor("axes", TensorProto.INT64, [4], [0, 1, 2, 3]),
        helper.make_tensor("two", TensorProto.INT64, [2], [1, 1]),
        helper.make_tensor("nothing", TensorProto.FLOAT, [1], [0.0]),
        helper.make_tensor("score", TensorProto.FLOAT, [1, 1], [1.0]),
    ]
    nodes = [
        helper.make_node("ReduceMax", ["orig_im_size"], ["side"], keepdims=1),
        helper.make_node("Div", ["orig_im_size", "side"], ["share"]),
        helper.make_node("Mul", ["share", "longest"], ["kept_f"]),
        helper.make_node("Round", ["kept_f"], ["kept_r"]),
        helper.make_node("Cast", ["kept_r"], ["kept"], to=TensorProto.INT64),
        helper.make_node("Concat", ["two", "kept"], ["ends"], axis=0),
        helper.make_node("Slice", ["mask_input", "zero", "ends", "axes"], ["cut"]),
        helper.make_node("Cast", ["orig_im_size"], ["size"], to=TensorProto.INT64),
        helper.make_node("Concat", ["two", "size"], ["sizes"], axis=0),
        helper.make_node("Resize", ["cut", "", "", "sizes"], ["spread"], mode="linear"),
        helper.make_node("Mul", ["spread", "has_mask_input"], ["switched"]),
        *(
            node
            for name in ("image_embeddings", "point_coords", "point_labels")
            for node in (
                helper.make_node("ReduceMean", [name], [f"{name}_mean"], keepdims=0),
                helper.make_node("Mul", [f"{name}_mean", "nothing"], [f"{name}_0"]),
            )
        ),
        helper.make_node(
            "Sum", ["switched", "image_embeddings_0", "point_coords_0", "point_labels_0"], ["masks"]
        ),
        helper.make_node("Identity", ["score"], ["iou_predictions"]),
    ]
    inputs = {
        "image_embeddings": [1, None, 64, 64],
        "point_coords": [1, None, 2],
        "point_labels": [1, None],
        "mask_input": [1, 1, 256, 256],
        "has_mask_input": [1],
        "orig_im_size": [2],
    }
    return graph(tmp_path / "decoder.onnx", nodes, inputs, ["masks", "iou_predictions"], constants)


@pytest.fixture
def lit(shared):
    return recording_io.load(shared / "data" / "lit_ur5e_1_00").subset([0, 1])


def test_the_prompt_arrives_where_the_robot_is_drawn(lit, encoder, decoder):
    from dataclasses import replace

    at_truth = replace(lit, initial_parent_T_camera=lit.truth_parent_T_camera)
    found = SegmentAnything(encoder, decoder)(at_truth)
    for i in range(2):
        mask, truth = found.mask(i), lit.mask(i)
        assert (mask & truth).sum() > 0.93 * (mask | truth).sum()  # the prompt has cells of 2.5 px


def test_points_are_on_and_off_the_robot():
    drawn, reach = np.zeros((2, 80, 100), bool)
    drawn[30:50, 40:80] = True
    reach[20:60, 30:90] = True
    points, labels = _points(drawn, reach)
    at = points.astype(int)
    assert (labels == 1).sum() >= 2
    assert drawn[at[labels == 1, 1], at[labels == 1, 0]].all()
    assert not reach[at[labels == 0, 1], at[labels == 0, 0]].any()
    np.testing.assert_array_equal(points[-2:], [[30, 20], [89, 59]])


def test_what_is_refused(lit, encoder, decoder, tmp_path):
    from dataclasses import replace

    with pytest.raises(InputError, match="give both graphs"):
        SegmentAnything(encoder)(lit)
    with pytest.raises(InputError, match="does not exist"):
        SegmentAnything(encoder, str(tmp_path / "absent.onnx"))(lit)
    with pytest.raises(InputError, match="no input 'image_embeddings' but image"):
        SegmentAnything(encoder, encoder)(lit)
    (tmp_path / "broken.onnx").write_bytes(b"nonsense")
    with pytest.raises(InputError, match="not an ONNX graph"):
        SegmentAnything(encoder, str(tmp_path / "broken.onnx"))(lit)
    with pytest.raises(Refusal, match="sam needs initial"):
        SegmentAnything(encoder, decoder)(replace(lit, initial_parent_T_camera=None))
