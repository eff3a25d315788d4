"""A ROS 1 or 2 bag, or an MCAP file: pictures, the lens, joints or transforms; a sample where the robot stands still.

The robot's poses are a chain of transforms between a base and a flange frame, or come from joints. How far the camera's
clock is off is where the robot's speed and the change from picture to picture correlate best. The mounting is proven by
the target in the pictures.
"""

from __future__ import annotations

import atexit
import shutil
import tempfile
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from hecbench import se3
from hecbench.errors import InputError
from hecbench.exchange.conventions import HINTS_NAME
from hecbench.exchange.pose_numbers import PoseConvention
from hecbench.recording import CameraModel, Mounting, Recording
from hecbench.registry import hookimpl
from hecbench.se3 import Array
from hecbench.specs import DatasetSpec
from hecbench.system import files
from hecbench.system.pictures import encode_png
from hecbench_datasets.reading import bags, kalibr
from hecbench_datasets.reading.hints import Hints, hinted_target, hints_for
from hecbench_datasets.reading.joint_poses import BASES, FLANGES, RobotReading, joint_readings
from hecbench_datasets.reading.pictured_proof import settled
from hecbench_datasets.reading.seen_targets import seen_target
from hecbench_datasets.reading.sources import YAML_SUFFIXES, files_in, foreign
from hecbench_datasets.reading.stills import offset_by_change_s, still_moments
from hecbench_datasets.reading.transforms import Transforms

_MOST_SAMPLES = 100
_METRE = 2.0
"""Radians that a metre counts as, where a robot's motion is one number."""


@dataclass
class _Content:
    """What one reading of the bag collects; pictures only as their stamps and how much they change."""

    transforms: Transforms = field(default_factory=Transforms)
    joints: dict[tuple[str, ...], list[list[float]]] = field(default_factory=dict)
    poses: list[list[float]] = field(default_factory=list)
    camera: CameraModel | None = None
    uncalibrated: bool = False
    picture_stamps: list[float] = field(default_factory=list)
    change: list[float] = field(default_factory=list)
    brightest: int = 255


def sniff(path: Path) -> bool:
    """A bag, or a folder with one."""
    return bool(bags.bag_files(path))


@foreign
def load(path: Path) -> Recording:
    """Read the bag twice: what moves when, then the pictures of the still moments."""
    hints, hints_file = hints_for(path)
    with bags.opened(path) as reader:
        topic = _image_topic(path, reader, hints)
        content = _collected(reader, topic)
        stamps, values, ways = _robot(path, content, hints)
        offset, notes = _offset(path, content, stamps, values, hints)
        chosen, rows = _chosen(path, content, stamps, values, offset)
        images = _stored(reader, topic, {content.picture_stamps[i] for i in chosen}, content.brightest)
    if content.camera is None and hints.camera is None:
        why = "its camera_info holds no intrinsics" if content.uncalibrated else "it has no camera_info"
        notes.append(
            f"{path}: {why}: they are calibrated from the pictures; or write camera into {HINTS_NAME}"
        )
    beside = files_in(hints_file.parent, *YAML_SUFFIXES)
    target = hinted_target(hints, hints_file) or kalibr.target_in(beside, notes)
    if target is None and hints.mounting is None:
        raise InputError(
            f"{path}: {len(images)} still moments seen in {topic}; {seen_target(images)} into {hints_file}, or "
            "mounting for methods without a target"
        )
    recording = Recording(
        name=path.stem,
        mounting=hints.mounting or Mounting.EYE_TO_HAND,
        sample_ids=tuple(f"{i:06d}" for i in range(len(images))),
        camera=hints.camera_model() or content.camera,
        target=target,
        joints_rad=np.zeros((len(images), 1)),
        robot_stamp_s=stamps[rows],
        camera_stamp_s=np.array([content.picture_stamps[i] for i in chosen]),
        images=tuple(images),
        folder=path if path.is_dir() else path.parent,
        notes=tuple(notes),
    )
    return settled(path, recording, [way.at(rows) for way in ways], hints, as_given=target is None)


def _image_topic(path: Path, reader: Any, hints: Hints) -> str:
    """The topic of colour pictures, the compressed one where a camera has both."""
    kinds = {c.topic: c.msgtype for c in reader.connections if c.msgtype in (bags.IMAGE, bags.COMPRESSED)}
    topics = [topic for topic in kinds if "depth" not in topic.lower() and "mask" not in topic.lower()]
    if hints.images is not None:
        topics = [topic for topic in kinds if topic == hints.images]
    twice = {topic for topic in topics if topic.removesuffix("/compressed") != topic}
    topics = [topic for topic in topics if f"{topic}/compressed" not in twice]
    if len(topics) == 1:
        return str(topics[0])
    shown = (
        ", ".join(topics or kinds) or f"only {', '.join(sorted({c.topic for c in reader.connections})[:10])}"
    )
    reason = "has pictures of several cameras" if len(topics) > 1 else "has no topic of colour pictures"
    raise InputError(f"{path}: {reason}: {shown}; write images: TOPIC into {HINTS_NAME}")


def _collected(reader: Any, topic: str) -> _Content:
    content = _Content()
    last = None
    place = topic.removesuffix("/compressed").rsplit("/", 1)[0]
    for connection, received, raw in reader.messages():
        kind = connection.msgtype
        if connection.topic == topic:
            whole = bags.picture_of(reader.deserialize(raw, kind), topic)
            if not isinstance(whole, bytes) and whole.size:
                content.brightest = max(content.brightest, int(whole.max()))
            picture = bags.small(whole)
            content.picture_stamps.append(bags.header_stamp_s(raw, reader.is2, received))
            content.change.append(
                0.0 if picture is None or last is None else float(np.abs(picture - last).mean())
            )
            last = picture if picture is not None else last
        elif kind == bags.CAMERA_INFO and content.camera is None and connection.topic.startswith(place):
            content.camera = bags.camera_model(reader.deserialize(raw, kind), connection.topic)
            content.uncalibrated = content.camera is None
        elif kind == bags.JOINTS:
            message = reader.deserialize(raw, kind)
            if len(message.position) and len(message.name) == len(message.position):
                row = [bags.header_stamp_s(raw, reader.is2, received), *map(float, message.position)]
                content.joints.setdefault(tuple(message.name), []).append(row)
        elif kind in bags.TF:
            for one in reader.deserialize(raw, kind).transforms:
                stamp = _seconds(one.header.stamp) or 1e-9 * received
                pose = _numbers(one.transform.translation, one.transform.rotation)
                static = connection.topic.endswith("tf_static")
                content.transforms.add(one.header.frame_id, one.child_frame_id, stamp, pose, static)
        elif kind in bags.POSES:
            message = reader.deserialize(raw, kind)
            pose = message.pose if hasattr(message, "pose") else message.transform
            at = pose.position if hasattr(pose, "position") else pose.translation
            turn = pose.orientation if hasattr(pose, "orientation") else pose.rotation
            stamp = bags.header_stamp_s(raw, reader.is2, received)
            content.poses.append([stamp, *_numbers(at, turn)])
    return content


def _seconds(stamp: Any) -> float:
    return float(stamp.sec) + 1e-9 * float(stamp.nanosec)


def _numbers(position: Any, turn: Any) -> list[float]:
    return [position.x, position.y, position.z, turn.x, turn.y, turn.z, turn.w]


def _by_stamp(rows: Sequence[Sequence[float]]) -> Array:
    """The rows in the order of their stamps, the first of equal ones."""
    table = np.array(rows)
    return table[np.unique(table[:, 0], return_index=True)[1]]


def _robot(path: Path, content: _Content, hints: Hints) -> tuple[Array, Array, list[RobotReading]]:
    """Stamps (N,) s, what shows motion (N, D), and the conventions of the robot's poses."""
    frames = content.transforms.frames
    base = hints.base_link or next((name for name in BASES if name in frames), None)
    tip = hints.flange_link or next((name for name in FLANGES if name in frames), None)
    faults = []
    if hints.robot is None and base is not None and tip is not None:
        try:
            stamps, poses = content.transforms.chain(base, tip)
            return (
                stamps,
                _motion(poses),
                [RobotReading(PoseConvention(poses, f"base_T_flange of {base} and {tip}"))],
            )
        except InputError as error:
            faults.append(str(error))
    for names, rows in sorted(content.joints.items(), key=lambda item: -len(item[1])):
        table = _by_stamp(rows)
        robots = (
            [path.parent / hints.robot if hints.robot.endswith(".urdf") else hints.robot]
            if hints.robot
            else []
        )
        try:
            found = joint_readings(table[:, 1:], names, robots, ("rad",))
        except InputError as error:
            faults.append(str(error))
            continue
        return table[:, 0], table[:, 1:], found
    if content.poses:
        table = _by_stamp(content.poses)
        poses = se3.from_quat_xyzw(table[:, 4:], table[:, 1:4])
        return (
            table[:, 0],
            _motion(poses),
            [RobotReading(PoseConvention(poses, "base_T_flange of stamped poses"))],
        )
    if frames:
        faults.append(
            f"its frames are {', '.join(sorted(frames)[:20])}: write base_link and flange_link into {HINTS_NAME}"
        )
    raise InputError(
        f"{path}: no robot poses: {'; '.join(faults) or 'neither tf nor joint_states was recorded'}"
    )


def _motion(poses: Array) -> Array:
    """(N, 6) rad of how poses move: turns from the first, and metres as radians."""
    turns = se3.so3_log(se3.inverse(poses[:1])[:, :3, :3] @ poses[:, :3, :3])
    return np.hstack([turns, _METRE * poses[:, :3, 3]])


def _offset(
    path: Path, content: _Content, stamps: Array, values: Array, hints: Hints
) -> tuple[float, list[str]]:
    """Seconds to add to the pictures' stamps, and how that is known."""
    if hints.time_offset_s is not None:
        return hints.time_offset_s, [f"{path}: clock offset {hints.time_offset_s:.3f} s, as given"]
    pictures = np.array(content.picture_stamps)
    offset, quality = offset_by_change_s(stamps, values, pictures, np.array(content.change))
    if offset is None:
        why = f"speed and change of pictures correlate to {quality:.2f}"
        note = f"{path}: the offset between the clocks is undetermined ({why}): taken as none"
        return 0.0, [f"{note}; write time_offset_s into {HINTS_NAME}"]
    return offset, [
        f"{path}: clock offset {offset:.2f} s (speed and change of pictures correlate to {quality:.2f})"
    ]


def _chosen(
    path: Path, content: _Content, stamps: Array, values: Array, offset: float
) -> tuple[list[int], Any]:
    """The picture nearest to the middle of each still moment, and the robot's row at its time."""
    moments = still_moments(stamps, values)
    at = np.array(content.picture_stamps) + offset
    chosen = []
    for start, end in moments:
        nearest = int(np.abs(at - (start + end) / 2).argmin()) if len(at) else -1
        if nearest >= 0 and start <= at[nearest] <= end and nearest not in chosen:
            chosen.append(nearest)
    if not chosen:
        raise InputError(
            f"{path}: the robot stands still in {len(moments)} moments, and no picture was taken in any of them; stop "
            "for a second at each pose"
        )
    chosen = [
        chosen[i]
        for i in np.unique(np.linspace(0, len(chosen) - 1, min(len(chosen), _MOST_SAMPLES)).astype(int))
    ]
    rows = np.clip(np.searchsorted(stamps, at[chosen]), 0, len(stamps) - 1)
    return chosen, rows


def _stored(reader: Any, topic: str, wanted: set[float], brightest: int) -> list[Path]:
    """The pictures of these stamps in files that live as long as the process."""
    folder = Path(tempfile.mkdtemp(prefix="hecbench-bag-"))
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    found: list[Path] = []
    connections = [connection for connection in reader.connections if connection.topic == topic]
    for connection, received, raw in reader.messages(connections):
        if bags.header_stamp_s(raw, reader.is2, received) not in wanted:
            continue
        wanted.discard(bags.header_stamp_s(raw, reader.is2, received))
        picture = bags.picture_of(reader.deserialize(raw, connection.msgtype), topic)
        if not isinstance(picture, bytes):
            picture = encode_png(bags.eight_bit(picture, brightest))
        suffix = ".jpg" if picture[:2] == b"\xff\xd8" else ".png"
        file = folder / f"{len(found):06d}{suffix}"
        files.write_bytes(file, picture)
        found.append(file)
    return found


@hookimpl
def hecbench_datasets() -> Iterable[DatasetSpec]:
    """This file's format."""
    yield DatasetSpec(
        name="ros_bag",
        summary="a ROS 1 or 2 bag or MCAP file: pictures, camera_info, joint_states, tf; samples where it stands",
        sniff=sniff,
        load=load,
        imports=("rosbags",),
    )
