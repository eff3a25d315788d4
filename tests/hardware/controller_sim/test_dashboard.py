"""Every command of the e-Series dashboard."""

import pytest

ANSWERS = [
    ("running", "Program running: false"),
    ("robotmode", "Robotmode: RUNNING"),
    ("get loaded program", "No program loaded"),
    ("load missing.urp", "File not found: missing.urp"),
    ("load /programs/external_control.urp", "Loading program: /programs/external_control.urp"),
    ("get loaded program", "Loaded program: /programs/external_control.urp"),
    ("load installation default.installation", "Loading installation: default.installation"),
    ("load installation other.installation", "File not found: other.installation"),
    ("pause", "Failed to execute: pause"),
    ("stop", "Stopped"),
    ("popup hello there", "showing popup"),
    ("close popup", "closing popup"),
    ("addToLog a remark", "Added log message"),
    ("addToLog", "No log message to add"),
    ("isProgramSaved", "true /programs/external_control.urp"),
    ("programState", "STOPPED /programs/external_control.urp"),
    ("version", "5.11.6.1090000"),
    ("set operational mode manual", "Setting operational mode: MANUAL"),
    ("get operational mode", "MANUAL"),
    ("set operational mode sideways", "Failed setting operational mode: sideways"),
    (
        "clear operational mode",
        "No longer controlling the operational mode. Current operational mode: 'NONE'.",
    ),
    ("get operational mode", "NONE"),
    ("safetystatus", "Safetystatus: NORMAL"),
    ("safetymode", "Safetymode: NORMAL"),
    ("close safety popup", "closing safety popup"),
    ("restart safety", "Restarting safety"),
    ("is in remote control", "true"),
    ("get serial number", "20205501234"),
    ("get robot model", "UR5"),
    ("generate flight report nonsense", "Error: 'nonsense' is not one of controller, software, system"),
    ("generate support file /tmp", "Error: no file system is simulated at '/tmp'"),
    ("power off", "Powering off"),
    ("robotmode", "Robotmode: POWER_OFF"),
    ("power on", "Powering on"),
    ("robotmode", "Robotmode: IDLE"),
    ("brake release", "Brake releasing"),
    ("ROBOTMODE", "Robotmode: RUNNING"),
    ("unlock protective stop", "Protective stop releasing"),
    ("make coffee", "could not understand: 'make coffee'"),
    ("shutdown", "Shutting down"),
]


@pytest.fixture
def say(dial):
    lines = dial(29999).makefile("rw")
    assert lines.readline() == "Connected: Universal Robots Dashboard Server\n"

    def exchange(command):
        lines.write(f"{command}\n")
        lines.flush()
        return lines.readline().rstrip("\n")

    exchange.lines = lines
    return exchange


def test_commands(say):
    for command, answer in ANSWERS:
        assert say(command) == answer, command
    assert say("generate flight report system").startswith("Flight Report generated with id: ")
    assert say("quit") == "Disconnected"
    assert say.lines.readline() == ""


def test_pause_and_play(say, dial, wait_until):
    assert say("play") == "Failed to execute: play"
    dial(30002, b"def long():\n sleep(9000)\nend\n")
    wait_until(lambda: say("running") == "Program running: true")
    assert say("programState") == "PLAYING long"
    assert say("pause") == "Pausing program"
    assert say("programState") == "PAUSED long"
    assert say("play") == "Starting program"
    assert say("running") == "Program running: true"
    assert say("stop") == "Stopped"


def test_external_control_without_a_server(say, controller, wait_until):
    """The log says whom it waited for; with one, see benchmarks/bench_robot_clients.py."""
    say("load external_control.urp")
    assert say("play") == "Starting program"
    wait_until(lambda: say("running") == "Program running: false")
    assert "External Control: nobody serves a program at 127.0.0.1:50002" in controller.ask("log")


def test_close_popup_lets_the_program_go_on(say, dial, controller, wait_until):
    dial(30002, b'def f():\n popup("ready?", blocking=True)\n textmsg("went on")\nend\n')
    wait_until(lambda: "popup: Popup: ready?" in controller.ask("log"))
    assert "went on" not in controller.ask("log")
    say("close popup")
    wait_until(lambda: "went on" in controller.ask("log"))
