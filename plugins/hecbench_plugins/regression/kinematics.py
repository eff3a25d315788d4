"""Forward kinematics of whole batches by pytorch-kinematics, for training."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import pytorch_kinematics
import torch
from torch import Tensor

from hecbench.robots.model import RobotModel
from hecbench.robots.writer import write_urdf
from hecbench_plugins.perception.skeleton import Keypoint


class Kinematics:
    """A robot's links and keypoints at many postures at once."""

    def __init__(self, model: RobotModel, keypoints: Sequence[Keypoint]) -> None:
        with TemporaryDirectory() as folder:
            path = Path(folder) / "robot.urdf"
            write_urdf(replace(model, parts=()), path)
            chain = pytorch_kinematics.build_chain_from_urdf(path.read_bytes())
        self._chain = chain.to(dtype=torch.float64)
        order = self._chain.get_joint_parameter_names()
        self._columns = [model.joint_names.index(name) for name in order]
        self._links = [k.link for k in keypoints]
        self._local = torch.tensor([[*k.position, 1.0] for k in keypoints], dtype=torch.float64)

    def __call__(self, joints_rad: Tensor, link: str) -> tuple[Tensor, Tensor]:
        """root_T_link (B, 4, 4) of one link, and all keypoints (B, K, 3) m in its frame, at joints (B, J)."""
        found = self._chain.forward_kinematics(joints_rad[:, self._columns].double())
        poses = {name: found[name].get_matrix() for name in {link, *self._links}}
        root_T_keypoint = torch.stack([poses[name] for name in self._links], 1)
        in_root = (root_T_keypoint @ self._local[None, :, :, None])[..., 0]
        root_T_link = poses[link]
        in_link = (in_root[..., :3] - root_T_link[:, None, :3, 3]) @ root_T_link[:, :3, :3]
        return root_T_link, in_link
