"""The language, run without a process: one program, as many cycles as it takes."""

import numpy as np
import pytest
from hecbench_hardware.controller_sim.arm import HOME_RAD, SimulatedArm
from hecbench_hardware.controller_sim.program import ProgramRunner
from hecbench_hardware.controller_sim.signals import RuntimeState
from hecbench_hardware.controller_sim.urscript.uploads import start_program
from hecbench_hardware.kinematics import ARMS

from hecbench import se3

Q = [0.3, -1.4, 1.5, -1.6, -1.5, 0.2]


@pytest.fixture
def runner():
    return ProgramRunner(SimulatedArm(ARMS["ur5e"]))


@pytest.fixture
def run(runner):
    """Runs a program to its end and returns what it said."""

    def to_the_end(body, cycles=20_000):
        text = "\n".join(body.splitlines())
        start_program(runner, f"def program():\n{text}\nend")
        for _ in range(cycles):
            if runner.runtime is not RuntimeState.PLAYING:
                break
            runner.step()
        else:
            pytest.fail("it does not end")
        return [line.split("textmsg: ")[1] for line in runner.arm.log if "textmsg: " in line]

    return to_the_end


@pytest.mark.parametrize(
    ("expression", "says"),
    [
        ("1 + 2 * 3", "7"),
        ("(1 + 2) * 3", "9"),
        ("-2 * -3", "6"),
        ("7 / 2", "3.5"),
        ("7 % 4", "3"),
        ("1 < 2 and not 2 < 1", "True"),
        ("True xor True", "False"),
        ("1 == 1.0", "True"),
        ('"a" == 1', "False"),
        ("[1, 2] + [3, 4]", "[4, 6]"),
        ("[2, 4] / 2", "[1, 2]"),
        ("2 * [1, 2]", "[2, 4]"),
        ("[[1, 2], [3, 4]][1, 0]", "3"),
        ("p[1, 2, 3, 0, 0, 0][2]", "3"),
        ('str_cat("a", 1)', "a1"),
        ('str_sub("abcdef", 2, 3)', "cde"),
        ('to_num("2.5")', "2.5"),
        ("norm(-3)", "3"),
        ("norm([3, 4])", "5"),
        ("floor(2.7)", "2"),
        ("d2r(180)", "3.14159"),
        ("atan2(1, 1)", "0.785398"),
        ("pow(2, 10)", "1024"),
        ("log(10, 1000)", "3"),
        ("binary_list_to_integer([True, False, True])", "5"),
        ("get_list_length([1, 2, 3])", "3"),
        ("pose_trans(p[1, 0, 0, 0, 0, d2r(90)], p[1, 0, 0, 0, 0, 0])", "p[1, 1, 0, 0, 0, 1.5708]"),
        ("pose_inv(p[1, 0, 0, 0, 0, 0])", "p[-1, -0, -0, 0, 0, 0]"),
        ("pose_dist(p[0, 0, 0, 0, 0, 0], p[0, 3, 4, 0, 0, 0])", "5"),
        ("rotvec2rpy(rpy2rotvec([0.1, 0.2, 0.3]))", "[0.1, 0.2, 0.3]"),
        ("struct(a=1, b=[2, 3]).b[1]", "3"),
        ("0x1F", "31"),
    ],
)
def test_values(run, expression, says):
    assert run(f"textmsg({expression})") == [says]


def test_flow(run):
    said = run("""
 def gauss(n, step=1):
   sum = 0
   while True:
     sum = sum + n
     n = n - step
     if n == 0:
       break
     elif n < 0:
       return -1
     else:
       continue
     end
   end
   return sum
 end
 global total = gauss(10)
 textmsg("gauss ", total)
 textmsg(gauss(n=9, step=2))
 a = [1, 2, 3]
 b = a
 b[0] = 9
 textmsg(a)
 local x = 5 # a remark, "with a quote
 $ 3 "a node of the pendant"
 if (x > 3 and
     x < 9): textmsg("within")
 end""")
    assert said == ["gauss 55", "-1", "[1, 2, 3]", "within"]


def test_threads_take_turns(run):
    said = run("""
 global count = 0
 thread counter():
   while True:
     count = count + 1
     sync()
   end
 end
 handle = run counter()
 sleep(0.1)
 kill handle
 textmsg(count)
 last = count
 sleep(0.1)
 textmsg(count == last)
 thread quick():
   sleep(0.02)
   count = -1
   return False
 end
 second = run quick()
 join second
 textmsg(count)
 enter_critical
 count = 7
 exit_critical
 halt
 textmsg("never")""")
    assert int(said[0]) == pytest.approx(50, abs=2)
    assert said[1:] == ["True", "-1"]


def test_a_critical_section_is_not_interrupted_but_may_wait(run):
    said = run("""
 global n = 0
 global seen = -1
 thread watcher():
   while True:
     seen = n
     sync()
   end
 end
 run watcher()
 enter_critical
 while n < 1000:
   n = n + 1
 end
 textmsg(seen)
 sleep(0.01)
 textmsg(seen)
 exit_critical""")
    assert said == ["-1", "1000"]


@pytest.mark.parametrize(
    ("body", "complaint"),
    [
        (" x = y + 1", "line 2: the name 'y' is not defined"),
        (" x = 1 / 0", "line 2: 1 / 0: division by zero"),
        (" x = [1, 2]\n y = x[2]", "line 3: [1, 2] has no item 2"),
        (" if 1:\n end", "True or False, not 1"),
        (" movej([0, 0, 0])", "line 2: movej(): the joints must be 6 numbers"),
        (" movej([0, 0, 0, 0, 0, 0], q=1)", "movej() takes (q, a, v, t, r)"),
        (" movel()", "movel() needs 'pose'"),
        (' sin("a")', "sin(): it must be a number, not a"),
        (" str_len(2)", "str_len(): it must be a text, not 2"),
        (" acos(2)", "acos(): math domain error"),
        (" movel(p[3, 0, 0, 0, 0, 0])", "unable to find an inverse kinematics solution"),
        (" write_output_integer_register(48, 1)", "a whole number from 0 to 47"),
        (" set_standard_digital_out(0, 1)", "b must be True or False, not 1"),
        (" def f():\n  f()\n end\n f()", "more than 40 calls within each other"),
        (" powerdown()", "switched the arm off"),
    ],
)
def test_an_error_ends_the_program_and_says_where(run, runner, body, complaint):
    run(body)
    assert complaint in runner.arm.log[-1]
    assert "program error: " in runner.arm.log[-1]
    assert "simulation failed" not in runner.arm.log[-1]
    assert runner.messages.count == 1


@pytest.mark.parametrize(
    ("text", "complaint"),
    [
        (
            "def f():\n movej([0, -1.57, 1.57, 0, 0, 0.4])\n conveyor_pulse_decode(1, 0, 1)\nend",
            "line 3: 'conveyor_pulse_decode' is not defined by the program, and not simulated",
        ),
        ("def f():\n run g()\nend", "line 2: 'g' is not defined"),
        ("def f():\n x = = 2\nend", "line 2: syntax error: a value expected, found '='"),
        ("def f():\n x = 1 2\nend", "line 2: syntax error: a new line expected, found '2'"),
        ("def f():\n x = 1 ? 2\nend", "line 2: syntax error: '?' cannot stand here"),
        ("def f():\n 1 = 2\nend", "line 2: syntax error: only a variable"),
        ("def f():\n rpc.move(1)\nend", "line 2: syntax error: methods are not simulated"),
        ("if True:\n movej([0, 0, 0, 0, 0, 0])\n", "'end' expected, found 'the end'"),
        ("x = " + "(" * 100 + "1" + ")" * 100, "more than 60 levels within each other"),
    ],
)
def test_nothing_of_a_program_with_an_unknown_word_runs(runner, text, complaint):
    start_program(runner, text)
    assert complaint in runner.arm.log[-1]
    assert runner.runtime is RuntimeState.STOPPED
    for _ in range(10):
        runner.step()
    assert runner.arm.joints.tolist() == list(HOME_RAD)


def test_motions_arrive(run, runner):
    run(f" movej({Q}, a=1.4, v=1.05)")
    assert runner.arm.joints.tolist() == Q
    start = runner.arm.base_T_tcp
    run(" movel(pose_add(get_actual_tcp_pose(), p[0, 0, 0.1, 0, 0, 0]), 1.2, 0.25)")
    np.testing.assert_allclose(runner.arm.base_T_tcp[:3, 3] - start[:3, 3], [0, 0, 0.1], atol=1e-12)
    run(" movep(pose_add(get_actual_tcp_pose(), p[0.05, 0, 0, 0, 0, 0]))")
    run(f" movel({Q})")
    np.testing.assert_allclose(runner.arm.joints, Q, atol=1e-9)
    before = runner.arm.time_s
    run(" movej(get_inverse_kin(pose_add(get_forward_kin(), p[0, 0.05, 0, 0, 0, 0])), t=2)")
    assert runner.arm.time_s - before == pytest.approx(2.0, abs=0.01)
    np.testing.assert_allclose(runner.arm.base_T_tcp[:3, 3] - start[:3, 3], [0, 0.05, 0], atol=1e-9)


def test_an_arc_keeps_its_distance_from_the_centre(runner):
    start_program(runner, f"movej({Q})")
    while runner.runtime is RuntimeState.PLAYING:
        runner.step()
    first = runner.arm.base_T_tcp[:3, 3]
    centre = first + np.array([0.0, 0.0, 0.05])
    start_program(
        runner,
        "def arc():\n here = get_actual_tcp_pose()\n"
        " movec(pose_add(here, p[0.05, 0, 0.05, 0, 0, 0]), pose_add(here, p[0, 0, 0.1, 0, 0, 0]), v=0.2)\nend",
    )
    radii = []
    while runner.runtime is RuntimeState.PLAYING:
        runner.step()
        radii.append(np.linalg.norm(runner.arm.base_T_tcp[:3, 3] - centre))
    np.testing.assert_allclose(radii, 0.05, atol=1e-9)
    np.testing.assert_allclose(runner.arm.base_T_tcp[:3, 3], first + np.array([0, 0, 0.1]), atol=1e-9)


def test_speeds_are_reached_held_and_reported(runner):
    start_program(runner, f"def f():\n movej({Q})\n speedl([0, 0, 0.05, 0, 0, 0], 0.5, 1.0)\n stopl(1)\nend")
    heard = []
    for _ in range(3000):
        runner.step()
        heard.append(runner.arm.tcp_speed[2])
    assert max(heard) == pytest.approx(0.05, abs=1e-4)
    assert sum(abs(speed - 0.05) < 1e-4 for speed in heard) > 400  # 1 s less the ramp of 0.1 s
    assert heard[-1] == 0.0


def test_servo_and_speed_of_joints(run, runner):
    run(
        f" movej({Q})\n q = get_actual_joint_positions()\n q[5] = q[5] + 0.1\n i = 0\n"
        " while i < 50:\n  servoj(q, t=0.002)\n  i = i + 1\n end\n stopj(4)"
    )
    assert runner.arm.joints[5] == pytest.approx(Q[5] + 0.1)
    before = runner.arm.joints[0]
    run(" speedj([0.2, 0, 0, 0, 0, 0], 1.0, 0.5)\n stopj(1.0)")
    travelled = 0.2 * 0.5 - 0.2**2 / 2 + 0.2**2 / 2  # ramp up within the half second, ramp down after it
    assert runner.arm.joints[0] - before == pytest.approx(travelled, abs=2e-3)


def test_outputs_registers_and_settings(run, runner):
    run("""
 set_digital_out(3, True)
 digital_out[5] = True
 set_configurable_digital_out(1, True)
 set_tool_digital_out(0, True)
 set_standard_analog_out(1, 0.25)
 set_tool_voltage(24)
 write_output_boolean_register(70, True)
 write_output_integer_register(2, 41 + 1)
 write_output_float_register(3, read_input_float_register(4) + 1)
 set_tcp(p[0, 0, 0.1, 0, 0, 0])
 set_payload(1.5, [0, 0, 0.03])
 set_gravity([0, 0, 9.82])
 if get_digital_out(3) and not get_digital_in(3):
   textmsg(get_target_payload_cog())
 end""")
    io = runner.arm.io
    run(" set_digital_out(9, True)\n textmsg(get_digital_out(9))\n set_tool_analog_input_domain(1, 0)")
    assert io.analog_input_domains == [1, 1, 1, 0]
    io.digital_outputs &= ~(1 << 17)
    assert io.digital_outputs == 1 << 3 | 1 << 5 | 1 << 9 | 1 << 16
    assert io.analog_outputs == [0.0, 0.25]
    assert io.tool_voltage == 24
    assert io.outputs.bits[70]
    assert io.outputs.ints[2] == 42
    assert io.outputs.doubles[3] == 1.0
    assert runner.arm.payload_kg == 1.5
    assert runner.arm.flange_T_tcp[2, 3] == pytest.approx(0.1)
    assert any(line.endswith("[0, 0, 0.03]") for line in runner.arm.log)


def test_gripper_functions(run, runner):
    runner.gripper.object_at = 120
    said = run("""
 rq_activate_and_wait()
 rq_set_speed_norm(100)
 rq_close_and_wait()
 textmsg(rq_current_pos(), rq_is_object_detected())
 rq_move_and_wait_mm(85)
 textmsg(rq_current_pos(), rq_is_object_detected())""")
    assert said == ["120True", "3False"]


def test_gripper_by_its_socket(run, runner):
    said = run("""
 open = socket_open("127.0.0.1", 63352, "g")
 socket_set_var("ACT", 1, "g")
 ack = socket_read_byte_list(3, "g", 0.1)
 textmsg(ack)
 socket_send_string("GET STA", "g")
 textmsg(socket_read_byte_list(1, "g"))
 textmsg(socket_get_var("POS", "g"))
 socket_close("g")
 textmsg(socket_read_byte_list(1, "g", 0.1)[0])
 textmsg(socket_open("192.168.0.7", 80, "far"))""")
    assert said[:4] == ["[3, 97, 99, 107]", "[1, 51]", "3", "0"]
    assert said[-1] == "False"


def test_force_mode_reaches_its_force_at_the_plane(runner):
    start_program(
        runner,
        f"def press():\n movej({Q})\n"
        " force_mode(p[0, 0, 0, 0, 0, 0], [0, 0, 1, 0, 0, 0], [0, 0, -20, 0, 0, 0], 2, [1, 1, 1, 1, 1, 1])\n"
        " sleep(3)\n end_force_mode()\nend",
    )
    while runner.arm.joints.tolist() != Q:
        runner.step()
    runner.arm.contact_plane_m = runner.arm.base_T_tcp[2, 3] - 0.02
    for _ in range(1400):
        runner.step()
    assert runner.arm.wrench[2] == pytest.approx(20.0, abs=0.5)


def test_a_blocking_popup_waits_for_somebody(runner):
    start_program(runner, 'def f():\n popup("go on?", blocking=True)\n textmsg("went on")\nend')
    for _ in range(50):
        runner.step()
    assert runner.popup == "go on?"
    runner.popup = None
    for _ in range(3):
        runner.step()
    assert runner.arm.log[-1].endswith("went on")


def test_a_secondary_program_does_not_disturb(runner):
    start_program(runner, 'def main():\n sleep(1)\n textmsg("main")\nend')
    runner.step()
    start_program(runner, "sec aside():\n set_digital_out(2, True)\nend")
    for _ in range(600):
        runner.step()
    assert runner.arm.io.digital_outputs == 4
    assert runner.arm.log[-1].endswith("main")


def test_a_watchdog_of_a_program(runner):
    start_program(runner, 'def f():\n rtde_set_watchdog("input_int_register_0", 10, "stop")\n sleep(9)\nend')
    for _ in range(60):
        runner.step()
    assert runner.runtime is RuntimeState.STOPPED
    assert "watchdog: the client is silent" in runner.arm.log[-1]


def test_pause_holds_the_arm(runner):
    start_program(runner, "movej([0.5, -1.4, 1.5, -1.6, -1.5, 0.2], v=0.2)")
    for _ in range(100):
        runner.step()
    assert runner.pause()
    runner.step()
    held = runner.arm.joints
    for _ in range(50):
        runner.step()
    assert runner.arm.joints is held
    assert not runner.arm.joint_speeds.any()
    assert runner.resume()
    while runner.runtime is RuntimeState.PLAYING:
        runner.step()
    assert runner.arm.joints[0] == 0.5


def test_a_busy_program_leaves_time_to_the_others(runner):
    start_program(
        runner,
        "def f():\n global n = 0\n thread spin():\n  while True:\n   n = n + 1\n  end\n end\n"
        " run spin()\n sleep(0.1)\n textmsg(n)\nend",
    )
    cycles = 0
    while runner.runtime is RuntimeState.PLAYING:
        runner.step()
        cycles += 1
    assert cycles < 60
    assert 1000 < int(runner.arm.log[-1].split()[-1]) < 50 * 401


def test_rotations_multiply_in_the_order_of_the_manual(runner):
    start_program(runner, "textmsg(pose_add(p[1, 0, 0, 0, 0, d2r(90)], p[1, 0, 0, d2r(90), 0, 0]))")
    runner.step()
    said = np.array([float(x) for x in runner.arm.log[-1].split("p[")[1].rstrip("]").split(", ")])
    turn = se3.from_rotvec([0, 0, np.pi / 2], np.zeros(3)) @ se3.from_rotvec([np.pi / 2, 0, 0], np.zeros(3))
    np.testing.assert_allclose(said[:3], [2, 0, 0])
    np.testing.assert_allclose(se3.so3_exp(said[3:]), turn[:3, :3], atol=1e-5)
