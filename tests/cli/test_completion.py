"""What the shell is offered after a word of a command line."""

import pytest
from click.shell_completion import ShellComplete

from hecbench.commands.cli import cli


@pytest.mark.parametrize(
    ("words", "incomplete", "among"),
    [
        (["solve", "cell", "--solver"], "tsa", {"tsai"}),
        (["solve", "cell", "--solver"], "render", {"render_gn", "render_gn_free"}),
        (["solve", "cell", "--segmenter"], "", {"background"}),
        (["run"], "mark", {"markers"}),
        (["import", "a", "b", "--format"], "ros", {"ros_bag"}),
        (["export", "a.json", "--to"], "moveit", {"moveit", "moveit_ros2"}),
        (["record", "cell", "--robot"], "sim", {"sim_ur3e", "sim_ur5e"}),
        (["trial", "grasp", "a.json", "--gripper"], "robot", {"robotiq"}),
        (["conformance"], "tsa", {"tsai"}),
        ([], "sol", {"solve"}),
    ],
)
def test_names_are_completed(words, incomplete, among):
    found = ShellComplete(cli, {}, "hecbench", "_HECBENCH_COMPLETE").get_completions(words, incomplete)
    assert among <= {item.value for item in found}
    assert all(item.value.startswith(incomplete) for item in found)


def test_a_recording_is_a_path_beside_the_suites():
    found = ShellComplete(cli, {}, "hecbench", "_HECBENCH_COMPLETE").get_completions(["run"], "")
    assert found[0].type == "file"
    assert {"markers", "paper"} & {item.value for item in found[1:]}
