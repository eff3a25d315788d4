"""The lattice's drawings are shared by threads: each pose gets the same answer, however many there are."""

import numpy as np
import pytest
from hecbench_plugins.start_search import by_photographs

from hecbench.rendering import RenderMesh
from hecbench.robots.model import load_robot
from hecbench.system import threads


@pytest.mark.parametrize("count", [1, 2, 3, 8])
def test_any_number_of_threads_gives_the_same_turns_and_costs(count, monkeypatch):
    robot, rng = load_robot("ur3e"), np.random.default_rng(0)
    mesh = RenderMesh.cached(robot, cell_m=0.04)
    K = np.array([[300.0, 0, 160], [0, 300, 120], [0, 0, 1]])
    links = robot.link_poses(rng.uniform(-1, 1, (3, 6)))
    seen = K, np.ones((240, 320), bool), links, rng.random((3, 240, 320)).astype(np.float32)
    poses = np.repeat(np.eye(4)[None], 3, 0)
    poses[:, 2, 3] = 2.0, 2.5, 3.0
    alone = [by_photographs._shifted(mesh, seen, pose[None], 40) for pose in poses]
    monkeypatch.setattr(threads, "count", lambda: count)
    turned, costs = by_photographs._shifted(mesh, seen, poses, 40)
    assert np.allclose(turned, np.concatenate([one for one, _ in alone]), rtol=0, atol=1e-12)
    assert np.allclose(costs, np.concatenate([cost for _, cost in alone]), rtol=1e-5)
