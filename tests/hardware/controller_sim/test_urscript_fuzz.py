"""Random programs of the language's own words: whatever they do, the controller goes on and its states can be sent."""

import random
import struct

import numpy as np
from hecbench_hardware.controller_sim.arm import SimulatedArm
from hecbench_hardware.controller_sim.outputs import READERS
from hecbench_hardware.controller_sim.program import ProgramRunner
from hecbench_hardware.controller_sim.realtime_state import realtime_state
from hecbench_hardware.controller_sim.robot_state import robot_state
from hecbench_hardware.controller_sim.server import VERSION
from hecbench_hardware.controller_sim.signals import FORMATS, OUTPUTS
from hecbench_hardware.controller_sim.urscript.library import LIBRARY
from hecbench_hardware.controller_sim.urscript.uploads import start_program
from hecbench_hardware.kinematics import ARMS

PROGRAMS, CYCLES = 500, 30
ATOMS = [
    "0",
    "1",
    "-1",
    "2.5",
    "255",
    "1e308",
    "-1e308",
    "1e400",
    "1e400*0",
    "99999999999999999999",
    "True",
    "False",
    '"a"',
    '""',
    '"%s"',
    "x",
    "y",
    "[]",
    "[1,2]",
    "[x,y]",
    "[0,-1.57,1.57,-1.57,-1.57,0]",
    "[[1,2],[3,4]]",
    "p[0.1,-0.4,0.3,0,3.14,0]",
    "p[1e308,0,0,0,0,0]",
    "p[0.3,0.3,0.3,1e30,0,0]",
    "struct(a=1)",
    "get_actual_tcp_pose()",
    "get_actual_joint_positions()",
    "f(1)",
]
OPERATORS = ["+", "-", "*", "/", "%", "==", "!=", "<", "and", "or", "xor"]
WORDS = ["break", "continue", "halt", "sync()", "enter_critical", "exit_critical", "kill x", "x = run f(1)"]
FUNCTIONS = sorted(LIBRARY.keys() - {"socket_open"})


def expression(dice, depth=0):
    kind = dice.random()
    if depth > 3 or kind < 0.45:
        return dice.choice(ATOMS)
    if kind < 0.6:
        return f"({expression(dice, depth + 1)} {dice.choice(OPERATORS)} {expression(dice, depth + 1)})"
    if kind < 0.95:
        name = dice.choice(FUNCTIONS)
        count = max(0, len(LIBRARY[name].parameters) + dice.choice([0, 0, 0, -1, -2, 1]))
        return f"{name}({', '.join(expression(dice, depth + 1) for _ in range(count))})"
    return f"{expression(dice, depth + 1)}[{expression(dice, depth + 1)}]"


def body(dice, depth=0):
    return "\n".join(statement(dice, depth) for _ in range(dice.randrange(1, 4)))


def statement(dice, depth):
    kind = dice.random()
    if kind < 0.3:
        return f"{dice.choice(['', 'global ', 'local '])}{dice.choice('xyz')} = {expression(dice)}"
    if kind < 0.4:
        return dice.choice(WORDS)
    if depth < 2 and kind < 0.5:
        return f"if {expression(dice)}:\n{body(dice, depth + 1)}\nelse:\n{body(dice, depth + 1)}\nend"
    if depth < 2 and kind < 0.55:
        return f"while {expression(dice)}:\n{body(dice, depth + 1)}\nend"
    if kind < 0.6:
        return f"x[{expression(dice)}] = {expression(dice)}"
    return expression(dice)


def sendable(runner):
    """Encodes every state there is."""
    robot_state(runner, VERSION)
    realtime_state(runner, VERSION)
    for name, kind in OUTPUTS.items():
        struct.pack(">" + FORMATS[kind], *np.ravel(READERS[name](runner)).tolist())


def test_random_programs():
    dice, reported = random.Random(15), 0
    for _ in range(PROGRAMS):
        runner = ProgramRunner(SimulatedArm(ARMS["ur5e"]))
        text = (
            f"def p():\nx = 1\ny = [1, 2]\ndef f(a, b=2):\n{body(dice)}\nend\n{body(dice)}\n{body(dice)}\nend"
        )
        with np.errstate(over="ignore", invalid="ignore"):
            start_program(runner, text)
            for _ in range(CYCLES):
                runner.step()
                assert np.abs(runner.arm.joints).max() <= 2 * np.pi, text
            sendable(runner)
        reported += any("program error" in line for line in runner.arm.log)
        runner.kill()
    assert reported > PROGRAMS / 2
