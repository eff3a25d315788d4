"""Bags of a cell that stops, written by their own writers, become recordings of the still moments."""

import re
from functools import partial

import numpy as np
import pytest

from hecbench import se3
from hecbench.errors import InputError
from hecbench.preparation import load_recording
from hecbench.recording import Mounting
from hecbench.storage.recording_io import encode_png

rosbags = pytest.importorskip("rosbags", reason="the extra 'bags' is not installed")

K = np.array([[400.0, 0, 160], [0, 400, 120], [0, 0, 1]])
SIZE = (320, 240)
SQUARE_M, COLUMNS, ROWS = 0.03, 6, 5
HINTS = f"target: {{kind: chessboard, columns: {COLUMNS}, rows: {ROWS}, square_m: {SQUARE_M}}}\n"
STOPS, PERIOD_S, RATE_HZ, PICTURES_HZ = 8, 2.0, 50, 12
LAG_S = 0.4
"""By which pictures are stamped too late."""


def board():
    """A drawn board, px per m, and where its first inner corner is."""
    pixels = 60
    cells = np.add.outer(np.arange(ROWS + 1), np.arange(COLUMNS + 1)) % 2
    drawn = np.pad(np.kron(cells, np.ones((pixels, pixels))) * 255, pixels, constant_values=255).astype(
        np.uint8
    )
    return drawn, pixels / SQUARE_M, 2 * pixels


def seen(camera_T_target):
    """The picture of the board at a pose."""
    import cv2

    drawn, scale, first = board()
    target_from_px = np.array([[1 / scale, 0, -first / scale], [0, 1 / scale, -first / scale], [0, 0, 1]])
    H = K @ camera_T_target[:3, [0, 1, 3]] @ target_from_px
    picture = cv2.warpPerspective(drawn, H, SIZE, flags=cv2.INTER_AREA, borderValue=110)
    return np.repeat(picture[..., None], 3, 2)


@pytest.fixture(scope="module")
def drive():
    """Stamps and base_T_flange of a drive with stops, and a function of the picture at a time: eye in hand."""
    rng = np.random.default_rng(3)
    flange_T_camera = se3.from_rotvec([0.1, -0.05, 1.5], [0.03, -0.05, 0.06])
    base_T_target = se3.from_rotvec([np.pi, 0.02, 0.1], [0.55, 0.05, 0.02])
    middle = se3.from_rotvec([0, 0, 0], [0.075, 0.06, -0.42])
    turns = rng.uniform(-0.35, 0.35, (STOPS, 3))
    stops = [
        base_T_target @ se3.from_rotvec(t, [0, 0, 0]) @ middle @ se3.inverse(flange_T_camera) for t in turns
    ]
    stamps = np.arange(0, STOPS * PERIOD_S, 1 / RATE_HZ)

    def pose(time):
        i = min(int(time / PERIOD_S), STOPS - 1)
        done = np.clip((time - i * PERIOD_S - 1.2) / 0.8, 0, 1)
        step = se3.inverse(stops[i]) @ stops[min(i + 1, STOPS - 1)]
        return stops[i] @ se3.exp(se3.log(step) * (3 * done**2 - 2 * done**3))

    poses = np.array([pose(time) for time in stamps])
    return (
        stamps,
        poses,
        lambda time: seen(se3.inverse(pose(time) @ flange_T_camera) @ base_T_target),
        flange_T_camera,
    )


def messages(store, drive, *, ros1, compressed=False, info=True, lag=LAG_S):
    """(topic, type, time s, message) of a drive in order of time."""
    from rosbags.typesys import get_types_from_msg

    stamps, poses, picture, _ = drive
    if ros1:
        store.register(
            get_types_from_msg("geometry_msgs/TransformStamped[] transforms", "tf2_msgs/msg/TFMessage")
        )
    types = store.types
    t0 = 1_700_000_000

    def header(time, frame=""):
        stamp = types["builtin_interfaces/msg/Time"](int(t0 + time), int(1e9 * (time % 1)))
        return types["std_msgs/msg/Header"](*((0, stamp, frame) if ros1 else (stamp, frame)))

    found = []
    quaternions = se3.to_quat_xyzw(poses)
    for time, pose, turn in zip(stamps, poses, quaternions, strict=True):
        vector = types["geometry_msgs/msg/Vector3"](*pose[:3, 3])
        rotation = types["geometry_msgs/msg/Quaternion"](*turn)
        transform = types["geometry_msgs/msg/Transform"](vector, rotation)
        stamped = types["geometry_msgs/msg/TransformStamped"](header(time, "base_link"), "wrist", transform)
        found.append(("/tf", "tf2_msgs/msg/TFMessage", time, types["tf2_msgs/msg/TFMessage"]([stamped])))
    fixed = types["geometry_msgs/msg/Transform"](
        types["geometry_msgs/msg/Vector3"](0.0, 0.0, 0.0),
        types["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0),
    )
    stamped = types["geometry_msgs/msg/TransformStamped"](header(0, "wrist"), "tool0", fixed)
    found.append(("/tf_static", "tf2_msgs/msg/TFMessage", 0.0, types["tf2_msgs/msg/TFMessage"]([stamped])))
    for time in np.arange(0.1, stamps[-1] - 0.1, 1 / PICTURES_HZ):
        image = picture(time)
        if compressed:
            data = np.frombuffer(encode_png(image), np.uint8)
            message = types["sensor_msgs/msg/CompressedImage"](header(time + lag, "cam"), "png", data)
            found.append(("/cam/image/compressed", "sensor_msgs/msg/CompressedImage", time + lag, message))
        else:
            row = 3 * SIZE[0]
            bgr = np.ascontiguousarray(image[..., ::-1]).ravel()
            message = types["sensor_msgs/msg/Image"](
                header(time + lag, "cam"), SIZE[1], SIZE[0], "bgr8", 0, row, bgr
            )
            found.append(("/cam/image", "sensor_msgs/msg/Image", time + lag, message))
    if info:
        roi = types["sensor_msgs/msg/RegionOfInterest"](0, 0, 0, 0, False)
        lens = np.zeros(5), K.ravel(), np.eye(3).ravel(), np.zeros(12), 0, 0, roi
        message = types["sensor_msgs/msg/CameraInfo"](header(0.2), SIZE[1], SIZE[0], "plumb_bob", *lens)
        found.append(("/cam/camera_info", "sensor_msgs/msg/CameraInfo", 0.2, message))
    return [
        (topic, kind, t0 + time, message) for topic, kind, time, message in sorted(found, key=lambda m: m[2])
    ]


def write_rosbags(path, drive, *, ros1=False, storage=None, **options):
    from rosbags.rosbag1 import Writer as Writer1
    from rosbags.rosbag2 import StoragePlugin
    from rosbags.rosbag2 import Writer as Writer2
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS1_NOETIC if ros1 else Stores.ROS2_HUMBLE)
    plugin = {"storage_plugin": StoragePlugin[storage]} if storage else {}
    with Writer1(path) if ros1 else Writer2(path, version=9, **plugin) as writer:
        connections = {}
        for topic, kind, time, message in messages(store, drive, ros1=ros1, **options):
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=store)
            raw = store.serialize_ros1(message, kind) if ros1 else store.serialize_cdr(message, kind)
            writer.write(connections[topic], int(time * 1e9), raw)


def write_mcap(path, drive, **options):
    writer_of = pytest.importorskip("mcap.writer", reason="mcap is not installed")
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_HUMBLE)
    with path.open("wb") as stream:
        writer = writer_of.Writer(stream)
        writer.start(profile="ros2")
        channels = {}
        for topic, kind, time, message in messages(store, drive, ros1=False, **options):
            if topic not in channels:
                definition, _ = store.generate_msgdef(kind, ros_version=2)
                schema = writer.register_schema(kind, "ros2msg", definition.encode())
                channels[topic] = writer.register_channel(topic, "cdr", schema)
            raw = bytes(store.serialize_cdr(message, kind))
            writer.add_message(channels[topic], int(time * 1e9), raw, int(time * 1e9))
        writer.finish()


WRITERS = {
    "a.bag": partial(write_rosbags, ros1=True),
    "ros2": partial(write_rosbags, storage="SQLITE3", compressed=True),
    "ros2_mcap": partial(write_rosbags, storage="MCAP"),
    "a.mcap": write_mcap,
}


@pytest.mark.parametrize("name", WRITERS)
def test_still_moments_become_samples(tmp_path, drive, spread, sniffers, name):
    from hecbench.preparation import prepare

    WRITERS[name](tmp_path / name, drive)
    assert sniffers(tmp_path / name) == ["ros_bag"]
    with pytest.raises(
        InputError, match=r"8 still moments seen in /cam/image.*a chessboard of (5 x 6|6 x 5) inner corners"
    ):
        load_recording(tmp_path / name)
    folder = tmp_path / name if (tmp_path / name).is_dir() else tmp_path
    (folder / "hecbench-import.yaml").write_text(HINTS)
    recording = load_recording(tmp_path / name)
    assert recording.mounting is Mounting.EYE_IN_HAND
    assert len(recording) == STOPS
    np.testing.assert_allclose(recording.camera.K, K)
    offset = float(re.search(r"clock offset (-?[\d.]+) s", recording.notes[0])[1])
    assert offset == pytest.approx(-LAG_S, abs=0.08)
    assert 1e3 * se3.translation_error_m(drive[3], spread(prepare(recording))[2]) < 3


def test_without_camera_info_it_is_said(tmp_path, drive):
    write_mcap(tmp_path / "a.mcap", drive, info=False)
    (tmp_path / "hecbench-import.yaml").write_text(HINTS)
    assert any(
        "has no camera_info: they are calibrated" in note
        for note in load_recording(tmp_path / "a.mcap").notes
    )


def test_a_robot_that_never_stops_is_refused(tmp_path, drive):
    stamps, poses, picture, X = drive
    rng = np.random.default_rng(1)
    moving = poses @ se3.exp(np.cumsum(rng.normal(0, 0.01, (len(poses), 6)), 0))
    write_mcap(tmp_path / "a.mcap", (stamps, moving, picture, X), lag=0.0)
    (tmp_path / "hecbench-import.yaml").write_text(HINTS)
    with pytest.raises(InputError, match="stop for a second at each pose"):
        load_recording(tmp_path / "a.mcap")


@pytest.mark.parametrize(
    "content", [b"", b"#ROSBAG V2.0\n", b"\x89MCAP0\r\n" + b"\x00" * 40, b"SQLite format 3\x00"]
)
@pytest.mark.parametrize("suffix", [".bag", ".mcap", ".db3"])
def test_damaged_bags_end_in_one_line(tmp_path, content, suffix):
    (tmp_path / f"a{suffix}").write_bytes(content)
    with pytest.raises(InputError) as caught:
        load_recording(tmp_path / f"a{suffix}")
    assert "\n" not in str(caught.value)
    assert f"a{suffix}" in str(caught.value)
