"""No argument is accepted in silence: the library acts on it, or says that it does not."""

import ast
import inspect
import textwrap

import numpy as np
import pytest
from hecbench_hardware.controller_sim.arm import SimulatedArm
from hecbench_hardware.controller_sim.program import ProgramRunner
from hecbench_hardware.controller_sim.signals import RuntimeState
from hecbench_hardware.controller_sim.urscript.library import LIBRARY
from hecbench_hardware.controller_sim.urscript.unsimulated import UNSIMULATED
from hecbench_hardware.controller_sim.urscript.uploads import start_program
from hecbench_hardware.kinematics import ARMS

HARMLESS = {
    ("get_inverse_kin", "maxPositionError"): "the solution is exact",
    ("get_inverse_kin", "maxOrientationError"): "the solution is exact",
    ("get_inverse_kin_has_solution", "maxPositionError"): "the solution is exact",
    ("get_inverse_kin_has_solution", "maxOrientationError"): "the solution is exact",
    ("make_list", "capacity"): "lists grow as far as the memory for values does",
    ("servoj", "a"): "the maker's controller does not use it either",
    ("servoj", "v"): "the maker's controller does not use it either",
    ("set_tcp", "tcp_name"): "names of tools are not kept",
}


@pytest.fixture
def runner():
    return ProgramRunner(SimulatedArm(ARMS["ur5e"]))


@pytest.fixture
def admitted(runner):
    """Runs a program; what it was told is not simulated."""

    def run(body, cycles=4000):
        start_program(runner, f"def program():\n{body}\nend")
        for _ in range(cycles):
            if runner.runtime is not RuntimeState.PLAYING:
                break
            runner.step()
        assert not [line for line in runner.arm.log if "program error" in line], list(runner.arm.log)
        return [line.split("not simulated: ")[1] for line in runner.arm.log if "not simulated" in line]

    return run


def unused(function):
    """Parameters that a function's body does not name."""
    tree = ast.parse(textwrap.dedent(inspect.getsource(function))).body[0]
    used = {node.id for part in tree.body for node in ast.walk(part) if isinstance(node, ast.Name)}
    return [p.rstrip("_") for p in list(inspect.signature(function).parameters)[1:] if p not in used]


def test_every_argument_is_used_or_said():
    said = {(name, one.parameter) for name, known in UNSIMULATED.items() for one in known}
    silent = [
        (name, parameter)
        for name, builtin in LIBRARY.items()
        if builtin.parameters
        for parameter in unused(builtin.function)
        if (name, parameter) not in said and (name, parameter) not in HARMLESS
    ]
    assert silent == []


def test_what_is_said_names_parameters_that_exist():
    for name, known in UNSIMULATED.items():
        names = [parameter for parameter, _ in LIBRARY[name].parameters]
        assert all(one.parameter in names for one in known), name


@pytest.mark.parametrize(
    ("call", "says"),
    [
        ("movej([0, -1.5, 1.5, -1.5, -1.5, 0], r=0.05)", "movej(): r: the arm stops at the point"),
        ("movel(get_actual_tcp_pose(), 1.2, 0.25, 0, 0.02)", "movel(): r: the arm stops"),
        ("servoj(get_actual_joint_positions(), 0, 0, 0.01)", "servoj(): gain:"),
        ("speedl([0, 0, 0, 0, 0, 0], 1, 0.01, 0.5)", "speedl(): aRot:"),
        ("freedrive_mode([1, 0, 0, 0, 0, 0])", "freedrive_mode(): freeAxes: all axes are free"),
        (
            "set_target_payload(1, [0, 0, 0.1], [0, 0, 0, 0, 0, 0], 0.5)",
            "transition_time: the payload changes at once",
        ),
        ("enable_external_ft_sensor(True, 0.3)", "sensor_mass: the wrench is taken as it is written"),
        ("force_mode_set_damping(0.5)", "force_mode_set_damping(): damping"),
    ],
)
def test_what_is_not_simulated_is_said_once(admitted, runner, call, says):
    before = runner.messages.count
    found = admitted(f"{call}\n{call}")
    assert len([line for line in found if says in line]) == 1, found
    assert runner.messages.count - before >= len(found), "the primary clients hear it too"


@pytest.mark.parametrize(
    "call",
    [
        "movej([0, -1.5, 1.5, -1.5, -1.5, 0])",
        "movel(get_actual_tcp_pose(), a=1, v=0.2, t=0, r=0)",
        "freedrive_mode([1, 1, 1, 1, 1, 1])",
        "set_target_payload(1, [0, 0, 0.1])",
        "stopl(1)",
    ],
)
def test_what_is_simulated_is_not_mentioned(admitted, call):
    assert admitted(call) == []


def test_every_program_hears_it_again(admitted):
    for times in (1, 2):
        assert len(admitted("movej([0, -1.5, 1.5, -1.5, -1.5, 0], r=0.05)")) == times


@pytest.mark.parametrize(("direction", "felt"), [((0, 0, -1), True), ((0, 0, 1), False), ((1, 0, 0), False)])
def test_contact_is_felt_against_its_direction(direction, felt):
    arm = SimulatedArm(ARMS["ur5e"])
    arm.external_force_n = 10.0
    arm.begin_cycle()
    arm.end_cycle()
    assert arm.feels_contact(direction) is felt
    assert arm.feels_contact()


def test_the_jacobian_of_another_tool():
    arm = SimulatedArm(ARMS["ur5e"])
    longer = np.eye(4)
    longer[2, 3] = 0.2
    expected = arm.jacobian(flange_T_tcp=longer)
    arm.set_tcp(np.array([0, 0, 0.2, 0, 0, 0]))
    np.testing.assert_allclose(arm.jacobian(), expected)
    assert np.abs(arm.jacobian() - arm.jacobian(flange_T_tcp=np.eye(4))).max() > 0.1
