"""Files made to harm end in one line, soon and without much memory, and nothing outside is read or written."""

import os
import pickle
import subprocess
import sys
import zipfile

import numpy as np
import pytest
from hecbench_datasets.reading.pickles import plain_pickle
from hecbench_datasets.reading.sources import yaml_value

from hecbench import registry
from hecbench.errors import InputError
from hecbench.preparation import load_recording
from hecbench.recording import Mounting, Recording
from hecbench.robots import urdf_files
from hecbench.specs import DatasetSpec, Kind
from hecbench.storage import recording_io
from hecbench.system import files, pictures

NINE = range(1, 12)
BOMBS = {
    "aliases": "a0: &a0 [x]\n" + "".join(f"a{i}: &a{i} [{','.join([f'*a{i - 1}'] * 9)}]\n" for i in NINE),
    "merges": "a0: &a0 {x: 1}\n"
    + "".join(f"a{i}: &a{i} {{<<: [{','.join([f'*a{i - 1}'] * 9)}]}}\n" for i in NINE),
    "cycle": "a: &a [*a, *a]\n",
    "brackets": "[" * 100_000,
    "dashes": "- " * 50_000,
}
LIMITED = """
import resource, sys
resource.setrlimit(resource.RLIMIT_CPU, (20, 20))
from pathlib import Path
from hecbench.errors import InputError
from hecbench_datasets.reading.{module} import {reader}
before = resource.getrusage(resource.RUSAGE_SELF)
try:
    {reader}(Path(sys.argv[1]))
    sys.exit("was read")
except InputError as error:
    after = resource.getrusage(resource.RUSAGE_SELF)
    print(after.ru_utime - before.ru_utime, after.ru_maxrss - before.ru_maxrss, str(error).count(chr(10)))
"""


def cost(module, reader, file):
    """Seconds, kB and line ends that refusing a file took, in a process of its own."""
    code = LIMITED.format(module=module, reader=reader)
    done = subprocess.run(
        [sys.executable, "-c", code, str(file)], capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, done.stderr
    return [float(word) for word in done.stdout.split()]


@pytest.mark.parametrize("name", BOMBS)
def test_yaml_that_expands_without_end_is_refused(tmp_path, name):
    (tmp_path / "bomb.yaml").write_text(BOMBS[name])
    seconds, kilobytes, lines = cost("sources", "yaml_value", tmp_path / "bomb.yaml")
    assert seconds < 10
    assert kilobytes < 200_000
    assert lines == 0


def test_yaml_aliases_of_honest_size_are_read(tmp_path):
    (tmp_path / "a.yaml").write_text("a: &x [1, 2]\nb: *x\nc: &y {r: 2}\nd: {<<: *y, q: 1}\n")
    assert yaml_value(tmp_path / "a.yaml") == {"a": [1, 2], "b": [1, 2], "c": {"r": 2}, "d": {"r": 2, "q": 1}}


class _Call:
    def __init__(self, function, *arguments):
        self.call = function, arguments

    def __reduce__(self):
        return self.call


def opcodes(*parts):
    return b"\x80\x05" + b"".join(parts) + b"."


PAYLOADS = {
    "call": pickle.dumps(_Call(os.system, "true")),
    "import": pickle.dumps(np.load),
    "objects": pickle.dumps(np.array([1, "a", None], object)),
    "structure": pickle.dumps(np.zeros(2, [("a", "f8"), ("b", "i4")])),
    "fields": b"\x80\x02cnumpy\ndtype\nU\x02f8K\x00K\x01\x87R(K\x03U\x01<NU\x01a\x85}U\x01aK\x00K\x00\x86s"
    b"J\xff\xff\xff\xffJ\xff\xff\xff\xffK\x00tb.",
    "long memo": opcodes(b"Nr\xff\xff\xff\x7f", b"j\xfe\xff\xff\x7f"),
    "long bytearray": opcodes(b"\x96" + (10**10).to_bytes(8, "little")),
    "cycle": opcodes(b"]\x94h\x00ah\x00h\x00a"),
    "shape": b"\x80\x02cnumpy.core.multiarray\n_reconstruct\ncnumpy\nndarray\nK\x00\x85U\x01b\x87R"
    b"(K\x01\x8a\x08\x00\x00\x00\x00\x00\x00\x00\x40\x85cnumpy\ndtype\nU\x02f8K\x00K\x01\x87R\x89U\x00tb.",
    "cut": pickle.dumps({"a": np.arange(3)})[:-9],
}


@pytest.mark.parametrize("name", PAYLOADS)
def test_pickles_that_hold_more_than_numbers_are_refused(tmp_path, name):
    (tmp_path / "labels").write_bytes(PAYLOADS[name])
    seconds, kilobytes, lines = cost("pickles", "plain_pickle", tmp_path / "labels")
    assert seconds < 10
    assert kilobytes < 200_000
    assert lines == 0


@pytest.mark.parametrize("protocol", range(6))
def test_plain_pickles_are_read_as_they_were_written(tmp_path, protocol):
    rng = np.random.default_rng(1)
    written = {
        "joints": [0.5, -1.0],
        "ee": np.asfortranarray(rng.normal(size=(2, 3))),
        "big_endian": np.arange(3, dtype=">i4"),
        "one": np.float64(2.5),
    }
    (tmp_path / "labels").write_bytes(pickle.dumps(written, protocol=protocol))
    read = plain_pickle(tmp_path / "labels")
    assert read["joints"] == written["joints"]
    for name in ("ee", "big_endian", "one"):
        np.testing.assert_array_equal(np.asarray(read[name]), written[name])


@pytest.mark.parametrize(
    "name", ["samples.yaml", "robot.csv", "recording.json", "robot_camera.zip", "a.samples"]
)
def test_a_pipe_is_no_file(tmp_path, sniffers, name):
    os.mkfifo(tmp_path / name)
    assert sniffers(tmp_path) == []
    assert sniffers(tmp_path / name) == []
    with pytest.raises(InputError, match="it is no regular file"):
        files.read_bytes(tmp_path / name)


def test_pictures_of_one_name_in_two_folders_stay_two(tmp_path):
    sources = []
    for folder, level in (("a", 10), ("b", 200), ("B", 90)):
        (tmp_path / "src" / folder).mkdir(parents=True)
        sources.append(tmp_path / "src" / folder / ("x.png" if folder != "B" else "X.png"))
        sources[-1].write_bytes(pictures.encode_png(np.full((4, 5), level, np.uint8)))
    own = tmp_path / "out" / "images" / "x_2.png"
    own.parent.mkdir(parents=True)
    own.write_bytes(pictures.encode_png(np.full((4, 5), 60, np.uint8)))
    recording = Recording(
        name="two",
        mounting=Mounting.EYE_TO_HAND,
        sample_ids=("0", "1", "2", "x", "4", "5"),
        base_T_flange=np.tile(np.eye(4), (6, 1, 1)),
        images=(*sources, np.full((4, 5, 3), 30, np.uint8), own, sources[0]),
    )
    recording_io.save(recording, tmp_path / "out")
    loaded = recording_io.load(tmp_path / "out")
    assert [int(loaded.image(i)[0, 0, 0]) for i in range(6)] == [10, 200, 90, 30, 60, 10]
    assert len({str(path).casefold() for path in loaded.images}) == 5


@pytest.mark.parametrize("hostile", ["../../../X", "/abs/X", "a\x00b", "..", "x" * 400, "a\nb", "C:\\x"])
def test_names_from_data_write_nothing_outside(tmp_path, hostile):
    recording = Recording(
        name=hostile,
        mounting=Mounting.EYE_TO_HAND,
        sample_ids=(hostile, "b"),
        base_T_flange=np.tile(np.eye(4), (2, 1, 1)),
        images=tuple(np.zeros((2, 4, 5, 3), np.uint8)),
    )
    recording_io.save(recording, tmp_path / "in" / "out")
    written = {path for path in tmp_path.rglob("*") if path.is_file()}
    assert len(written) == 3
    assert all(path.is_relative_to(tmp_path / "in" / "out") for path in written)
    assert recording_io.load(tmp_path / "in" / "out").sample_ids[0] == hostile


def test_names_stay_different_and_plain_names_stay():
    names = ["a/b", "a_b", "a:b", "..a", "a", "x" * 200, "x" * 201, "été_1.5-2"]
    safe = [files.safe_name(name) for name in names]
    assert len(set(safe)) == len(names)
    assert safe[4] == "a"
    assert safe[7] == names[7]


def test_an_obj_takes_only_materials_beside_it(tmp_path):
    (tmp_path / "robot").mkdir()
    (tmp_path / "secret").write_text("secret")
    os.symlink(tmp_path / "secret", tmp_path / "robot" / "linked.mtl")
    mesh = "mtllib ../secret /etc/passwd linked.mtl own.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"
    (tmp_path / "robot" / "a.obj").write_text(mesh)
    (tmp_path / "robot" / "own.mtl").write_text("newmtl a\n")
    urdf = '<robot name="r"><link name="a"><visual><geometry><mesh filename="{}"/></geometry></visual></link></robot>'
    (tmp_path / "robot" / "r.urdf").write_text(urdf.format("a.obj"))
    urdf_files.copy(tmp_path / "robot" / "r.urdf", tmp_path / "copy")
    copied = {path.name for path in (tmp_path / "copy").rglob("*") if path.is_file()}
    assert copied == {"r.urdf", "a.obj", "own.mtl"}
    (tmp_path / "robot" / "r.urdf").write_text(urdf.format("/etc/passwd"))
    with pytest.raises(InputError, match="'/etc/passwd' is no mesh file"):
        urdf_files.copy(tmp_path / "robot" / "r.urdf", tmp_path / "copy2")


def test_recognising_a_set_parses_no_pickle(tmp_path, sniffers, monkeypatch):
    def forbidden(*_):
        raise AssertionError("a pickle was parsed")

    (tmp_path / "pose_0").mkdir()
    (tmp_path / "ground_truth_data").write_bytes(PAYLOADS["fields"])
    with monkeypatch.context() as patched:
        patched.setattr("pickle._Unpickler.load", forbidden)
        assert sniffers(tmp_path) == ["baxter"]
    with pytest.raises(InputError, match="structures"):
        registry.load().get(Kind.DATASET, "baxter", DatasetSpec).load(tmp_path)


@pytest.mark.parametrize("suffix", [".npz", ".xlsx"])
def test_an_archive_that_unpacks_without_end_is_refused(tmp_path, suffix):
    with zipfile.ZipFile(tmp_path / f"robot{suffix}", "w", zipfile.ZIP_DEFLATED) as archive:
        for i in range(3):
            archive.writestr(f"{i}.npy", bytes(50 << 20))
    with pytest.raises(InputError, match="unpacks to 150 MB"):
        load_recording(tmp_path)


def test_a_hundred_thousand_links_within_links(tmp_path):
    depth = 100_000
    (tmp_path / "r.urdf").write_text("<robot>" + "<link>" * depth + "</link>" * depth + "</robot>")
    with pytest.raises(InputError) as caught:
        urdf_files.copy(tmp_path / "r.urdf", tmp_path / "copy")
    assert "\n" not in str(caught.value)
