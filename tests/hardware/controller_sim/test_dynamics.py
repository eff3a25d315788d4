"""Laws of the estimate of joint torques."""

import numpy as np
import pytest
from hecbench_hardware.controller_sim import dynamics
from hecbench_hardware.controller_sim.arm import SimulatedArm
from hecbench_hardware.controller_sim.dynamics import Dynamics
from hecbench_hardware.controller_sim.program import ProgramRunner
from hecbench_hardware.controller_sim.urscript.uploads import start_program
from hecbench_hardware.kinematics import ARMS

UP = np.array([0.0, 0.0, 9.82])


@pytest.fixture(params=sorted(ARMS))
def loaded(request):
    return Dynamics(ARMS[request.param], 1.5, (0.01, 0.02, 0.05))


def potential_energy(model, joints):
    frames = model.arm.link_frames(joints)[[0, 1, 2, 3, 4, 5, 5]]
    centres = np.einsum("kij,kj->ki", frames[:, :3, :3], model._centres) + frames[:, :3, 3]
    return model._masses @ centres @ UP


def test_gravity_is_the_slope_of_the_potential_energy(loaded, rng):
    for joints in rng.uniform(-3, 3, (10, 6)):
        slope = [
            (potential_energy(loaded, joints + step) - potential_energy(loaded, joints - step)) / 2e-6
            for step in 1e-6 * np.eye(6)
        ]
        np.testing.assert_allclose(loaded.gravity(joints, UP), slope, atol=1e-6)


def test_inertia_is_symmetric_and_positive(loaded, rng):
    for joints in rng.uniform(-3, 3, (10, 6)):
        inertia = loaded.mass_matrix(joints)
        np.testing.assert_allclose(inertia, inertia.T, atol=1e-12)
        assert np.linalg.eigvalsh(inertia).min() > 0


def test_without_friction_motion_keeps_its_energy(loaded, rng, monkeypatch):
    """The Coriolis torques do no work."""
    monkeypatch.setattr(dynamics, "VISCOUS_NM_S", np.zeros(6))
    joints, speeds = rng.uniform(-2, 2, 6), rng.uniform(-1, 1, 6)
    energies = []
    for _ in range(200):
        energies.append(speeds @ loaded.mass_matrix(joints) @ speeds / 2)
        joints, speeds = loaded.accelerate(joints, speeds, np.zeros(6), 2e-4)
    assert max(energies) / min(energies) < 1.002


def test_a_resting_arm_holds_its_weight():
    """Stretched out level: every centre pulls at the shoulder with its own lever."""
    arm = SimulatedArm(ARMS["ur5e"])
    arm.joints = np.zeros(6)
    shoulder = arm.torques[1]
    assert 50 < abs(shoulder) < 80
    arm.payload_kg = 5.0
    assert abs(arm.torques[1]) > abs(shoulder) + 5 * 9.82 * 0.8


def test_a_torque_loop_follows_its_target():
    """The control law of ur_rtde's example: proportional and derivative, half a radian back and forth."""
    runner = ProgramRunner(SimulatedArm(ARMS["ur5e"]))
    start_program(
        runner,
        """def follow():
 start = get_actual_joint_positions()
 t = 0
 while t < 6.2831853:
   goal = start
   goal[1] = start[1] + 0.5 * sin(t)
   error = goal - get_actual_joint_positions()
   speed = get_actual_joint_speeds()
   torque = [0, 0, 0, 0, 0, 0]
   gain = [400, 400, 200, 50, 50, 50]
   i = 0
   while i < 6:
     torque[i] = gain[i] * error[i] - 0.1 * gain[i] * speed[i]
     i = i + 1
   end
   direct_torque(torque)
   t = t + get_steptime()
 end
end""",
    )
    start, seen = runner.arm.joints, []
    for _ in range(3200):
        runner.step()
        seen.append(runner.arm.joints - start)
    assert not [line for line in runner.arm.log if "error" in line]
    assert np.max(seen, axis=0)[1] == pytest.approx(0.5, abs=0.1)
    assert np.min(seen, axis=0)[1] == pytest.approx(-0.5, abs=0.1)
    assert np.abs(np.delete(seen, 1, axis=1)).max() < 0.1
