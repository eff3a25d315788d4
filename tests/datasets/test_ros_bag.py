"""Bags of a cell that stops, written by their own writers, become recordings of the still moments."""

import re
from functools import partial

import numpy as np
import pytest

from hecbench import se3
from hecbench.errors import InputError
from hecbench.preparation import load_recording
from hecbench.recording import Mounting
from hecbench.system.pictures import encode_png

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


LENSES = {
    "plumb_bob": [-0.25, 0.08, 1e-3, -5e-4, 0.02],
    "rational_polynomial": [0.4, -0.3, 1e-3, -5e-4, 0.05, 0.7, -0.4, 0.1],
    "equidistant": [-0.03, 0.01, -0.005, 0.001],
}


def seen(camera_T_target):
    """The picture of the board at a pose, without distortion."""
    import cv2

    drawn, scale, first = board()
    target_from_px = np.array([[1 / scale, 0, -first / scale], [0, 1 / scale, -first / scale], [0, 0, 1]])
    H = K @ camera_T_target[:3, [0, 1, 3]] @ target_from_px
    picture = cv2.warpPerspective(drawn, H, SIZE, flags=cv2.INTER_AREA, borderValue=110)
    return np.repeat(picture[..., None], 3, 2)


def through(lens, picture):
    """What an ideal picture looks like through a lens."""
    import cv2

    pixels = np.stack(np.meshgrid(np.arange(SIZE[0]), np.arange(SIZE[1])), -1).reshape(-1, 1, 2) * 1.0
    D = np.array(LENSES[lens])
    undistorted = cv2.fisheye.undistortPoints if lens == "equidistant" else cv2.undistortPoints
    places = undistorted(pixels, K, D, P=K).reshape(SIZE[1], SIZE[0], 2).astype(np.float32)
    return cv2.remap(picture, places[..., 0], places[..., 1], cv2.INTER_LINEAR, borderValue=110)


FLANGE_T_CAMERA = se3.from_rotvec([0.1, -0.05, 1.5], [0.03, -0.05, 0.06])


CENTRED = se3.from_rotvec([0, 0, 0], [0.075, 0.06, -0.42])
"""target_T_camera of a camera before the middle of the board."""


def around(base_T_target):
    """base_T_flange of stops that turn about the board."""
    turns = np.random.default_rng(3).uniform(-0.35, 0.35, (STOPS, 3))
    return [
        base_T_target @ se3.from_rotvec(turn, [0, 0, 0]) @ CENTRED @ se3.inverse(FLANGE_T_CAMERA)
        for turn in turns
    ]


def driven(stops, between):
    """Stamps, and what `between(stop, next, share)` gives at them, for a drive that rests at every stop."""
    stamps = np.arange(0, len(stops) * PERIOD_S, 1 / RATE_HZ)

    def at(time):
        i = min(int(time / PERIOD_S), len(stops) - 1)
        done = np.clip((time - i * PERIOD_S - 1.2) / 0.8, 0, 1)
        return between(stops[i], stops[min(i + 1, len(stops) - 1)], 3 * done**2 - 2 * done**3)

    return stamps, np.array([at(time) for time in stamps]), at


@pytest.fixture(scope="module")
def drive():
    """Stamps and base_T_flange of a drive with stops, and a function of the picture at a time: eye in hand."""
    base_T_target = se3.from_rotvec([np.pi, 0.02, 0.1], [0.55, 0.05, 0.02])
    stops = around(base_T_target)
    stamps, poses, pose = driven(stops, lambda a, b, share: a @ se3.exp(se3.log(se3.inverse(a) @ b) * share))
    return stamps, poses, lambda time: seen(se3.inverse(pose(time) @ FLANGE_T_CAMERA) @ base_T_target)


@pytest.fixture(scope="module")
def jointed():
    """The same of a UR5e, with its joints in place of the poses."""
    from scipy.optimize import least_squares

    from hecbench.robots.model import load_robot

    model = load_robot("ur5e", meshes=False)
    middle = np.array([0.0, -1.3, 1.4, -1.67, -1.57, 0.0])

    def flange(q):
        return model.forward(q[None], model.joint_names, base="base", tip="tool0")[0]

    base_T_target = flange(middle) @ FLANGE_T_CAMERA @ se3.inverse(CENTRED)
    stops = [
        least_squares(lambda q: se3.log(se3.inverse(goal) @ flange(q)), middle).x  # noqa: B023
        for goal in around(base_T_target)
    ]
    stamps, joints, at = driven(stops, lambda a, b, share: a + share * (b - a))
    names = tuple(model.joint_names)
    return (
        stamps,
        (names, joints),
        lambda time: seen(se3.inverse(flange(at(time)) @ FLANGE_T_CAMERA) @ base_T_target),
    )


PATTERNS = {"rggb": "RGGB", "bggr": "BGGR", "gbrg": "GBRG", "grbg": "GRBG"}


def encoded(picture, encoding):
    """Rows of a picture as a driver of that encoding gives them, and the bytes of a row."""
    import cv2

    if encoding == "mono16":
        rows = (picture[..., 1].astype("<u2") << 4).view(np.uint8)  # 12 bits, as most such cameras give
    elif encoding.startswith("bayer"):
        rows = np.empty(picture.shape[:2], np.uint8)
        for place, colour in enumerate(PATTERNS[encoding[6:10]]):
            at = np.s_[place // 2 :: 2, place % 2 :: 2]
            rows[at] = picture[..., "RGB".index(colour)][at]
    elif encoding == "yuv422_yuy2":
        rows = cv2.cvtColor(picture, cv2.COLOR_RGB2YUV_YUY2)
    else:
        rows = cv2.cvtColor(picture, {"bgr8": cv2.COLOR_RGB2BGR, "rgba8": cv2.COLOR_RGB2RGBA}[encoding])
    rows = np.ascontiguousarray(rows).reshape(len(picture), -1)
    return rows.ravel(), rows.shape[1]


def messages(store, drive, *, ros1, compressed=False, info=True, lag=LAG_S, encoding="bgr8", lens=None):
    """(topic, type, time s, message) of a drive in order of time."""
    from rosbags.typesys import get_types_from_msg

    stamps, robot, ideal = drive
    picture = ideal if lens is None else lambda time: through(lens, ideal(time))
    if ros1:
        store.register(
            get_types_from_msg("geometry_msgs/TransformStamped[] transforms", "tf2_msgs/msg/TFMessage")
        )
    types = store.types
    t0 = 1_700_000_000

    def header(time, frame=""):
        stamp = types["builtin_interfaces/msg/Time"](int(t0 + time), int(1e9 * (time % 1)))
        return types["std_msgs/msg/Header"](*((0, stamp, frame) if ros1 else (stamp, frame)))

    found = moved(types, header, stamps, robot)
    for time in np.arange(0.1, stamps[-1] - 0.1, 1 / PICTURES_HZ):
        image = picture(time)
        if compressed:
            data = np.frombuffer(encode_png(image), np.uint8)
            message = types["sensor_msgs/msg/CompressedImage"](header(time + lag, "cam"), "png", data)
            found.append(("/cam/image/compressed", "sensor_msgs/msg/CompressedImage", time + lag, message))
        else:
            data, step = encoded(image, encoding)
            message = types["sensor_msgs/msg/Image"](
                header(time + lag, "cam"), SIZE[1], SIZE[0], encoding, 0, step, data
            )
            found.append(("/cam/image", "sensor_msgs/msg/Image", time + lag, message))
    if info:
        roi = types["sensor_msgs/msg/RegionOfInterest"](0, 0, 0, 0, False)
        D = np.array(LENSES[lens]) if lens else np.zeros(5)
        told = lens or "plumb_bob", D, K.ravel(), np.eye(3).ravel(), np.zeros(12), 0, 0, roi
        message = types["sensor_msgs/msg/CameraInfo"](header(0.2), SIZE[1], SIZE[0], *told)
        found.append(("/cam/camera_info", "sensor_msgs/msg/CameraInfo", 0.2, message))
    return [
        (topic, kind, t0 + time, message) for topic, kind, time, message in sorted(found, key=lambda m: m[2])
    ]


def moved(types, header, stamps, robot):
    """The robot's messages: transforms of its poses, or its joints (their names, and (N, J) rad)."""
    if isinstance(robot, tuple):
        names, joints = robot
        state, kind = types["sensor_msgs/msg/JointState"], "sensor_msgs/msg/JointState"
        empty = np.zeros(0)
        return [
            ("/joint_states", kind, time, state(header(time), list(names), row, empty, empty))
            for time, row in zip(stamps, joints, strict=True)
        ]
    found = []
    for time, pose, turn in zip(stamps, robot, se3.to_quat_xyzw(robot), strict=True):
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
    return found


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
    assert 1e3 * se3.translation_error_m(FLANGE_T_CAMERA, spread(prepare(recording))[2]) < 3


@pytest.mark.parametrize("lens", LENSES)
def test_the_lens_of_camera_info_is_used(tmp_path, drive, spread, lens):
    from hecbench.preparation import prepare

    write_mcap(tmp_path / "a.mcap", drive, lens=lens)
    (tmp_path / "hecbench-import.yaml").write_text(HINTS)
    recording = load_recording(tmp_path / "a.mcap")
    assert recording.camera.distortion_model == ("equidistant" if lens == "equidistant" else "opencv")
    np.testing.assert_allclose(recording.camera.distortion, LENSES[lens])
    assert 1e3 * se3.translation_error_m(FLANGE_T_CAMERA, spread(prepare(recording))[2]) < 3


def test_twelve_bits_in_sixteen_are_not_dark(tmp_path, drive, spread):
    from hecbench.preparation import prepare

    write_mcap(tmp_path / "a.mcap", drive, encoding="mono16")
    (tmp_path / "hecbench-import.yaml").write_text(HINTS)
    recording = load_recording(tmp_path / "a.mcap")
    assert recording.image(0).max() == 255
    assert 1e3 * se3.translation_error_m(FLANGE_T_CAMERA, spread(prepare(recording))[2]) < 3


@pytest.mark.parametrize(
    "encoding", ["bgr8", "rgba8", "yuv422_yuy2", *(f"bayer_{pattern}8" for pattern in PATTERNS)]
)
def test_encodings_of_drivers_keep_their_colours(encoding):
    from types import SimpleNamespace

    from hecbench_datasets.reading.bags import picture_of

    picture = np.full((8, 10, 3), (200, 120, 40), np.uint8)
    data, step = encoded(picture, encoding)
    message = SimpleNamespace(data=data, step=step, height=8, width=10, encoding=encoding, is_bigendian=0)
    found = picture_of(message, "/cam")
    assert found.shape == picture.shape
    assert np.abs(found.astype(int) - picture).max() <= 3


def test_joints_alone_are_of_the_arm_with_their_names(tmp_path, jointed, spread):
    from hecbench.preparation import prepare

    write_mcap(tmp_path / "a.mcap", jointed)
    (tmp_path / "hecbench-import.yaml").write_text(HINTS)
    recording = load_recording(tmp_path / "a.mcap")
    assert recording.robot.model == "ur5e"
    assert recording.joints_rad.shape == (STOPS, 6)
    assert 1e3 * se3.translation_error_m(FLANGE_T_CAMERA, spread(prepare(recording))[2]) < 3


def info(**changes):
    from types import SimpleNamespace

    roi = SimpleNamespace(width=0, height=0)
    fields = {"width": 320, "height": 240, "k": K.ravel(), "d": np.zeros(5), "roi": roi, "binning_x": 0}
    return SimpleNamespace(**{**fields, "binning_y": 0, "distortion_model": "plumb_bob", **changes})


def test_camera_infos_as_drivers_write_them():
    from types import SimpleNamespace

    from hecbench_datasets.reading.bags import camera_model

    whole, cut = SimpleNamespace(width=320, height=240), SimpleNamespace(width=160, height=240)
    assert camera_model(info(k=np.zeros(9)), "/c") is None
    assert camera_model(info(roi=whole), "/c").K[0, 0] == K[0, 0]
    assert camera_model(info(distortion_model="none"), "/c").distortion.size == 0
    assert camera_model(info(d=np.r_[0.1, np.zeros(4), 0.2, 0, 0]), "/c").distortion.size == 8
    with pytest.raises(InputError, match="distortion_model 'none' is not one of plumb_bob"):
        camera_model(info(distortion_model="none", d=np.ones(5)), "/c")
    with pytest.raises(InputError, match="binned or cut"):
        camera_model(info(roi=cut), "/c")


def test_without_camera_info_it_is_said(tmp_path, drive):
    write_mcap(tmp_path / "a.mcap", drive, info=False)
    (tmp_path / "hecbench-import.yaml").write_text(HINTS)
    assert any(
        "has no camera_info: they are calibrated" in note
        for note in load_recording(tmp_path / "a.mcap").notes
    )


def test_a_robot_that_never_stops_is_refused(tmp_path, drive):
    stamps, poses, picture = drive
    rng = np.random.default_rng(1)
    moving = poses @ se3.exp(np.cumsum(rng.normal(0, 0.01, (len(poses), 6)), 0))
    write_mcap(tmp_path / "a.mcap", (stamps, moving, picture), lag=0.0)
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
