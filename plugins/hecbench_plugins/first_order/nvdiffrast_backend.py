"""nvdiffrast (Laine et al. 2020) in the place of the CPU renderer. UNTESTED: it needs CUDA, which no machine here has.

nvdiffrast is licensed for non-commercial use and is not a dependency of hecbench: install it yourself, and choose it
with the option `backend=nvdiffrast`.
"""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from importlib.util import find_spec
from itertools import pairwise
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from hecbench.errors import Refusal
from hecbench.rendering import RenderMesh
from hecbench.se3 import Array
from hecbench_plugins.first_order.drawing import Box
from hecbench_plugins.views.pyramid import Picture, View

_NEAR_M, _FAR_M = 0.05, 10.0


class NvdiffrastDrawer:
    """A `Drawer` on CUDA whose box is the whole picture; the arguments are `CpuDrawer`'s."""

    def __init__(
        self, meshes: Sequence[RenderMesh], colours: Picture, view: View, K: Array, width: int, height: int
    ) -> None:
        if find_spec("nvdiffrast") is None or not torch.cuda.is_available():
            raise Refusal(
                "backend=nvdiffrast needs the package nvdiffrast and a CUDA device: use backend=cpu"
            )
        self._rasterizer: Any = import_module("nvdiffrast.torch")
        self._context = self._rasterizer.RasterizeCudaContext()
        self.width, self.height = width, height
        self.box: Box | None = None
        self._projection = _cuda(_projection(K, width, height))
        self._background = _cuda(colours[-1])
        self._meshes = [_on_cuda(mesh, colours, view.parent_T_link) for mesh in meshes]
        self._twist = torch.zeros(6, device="cuda", requires_grad=True)
        self._picture = torch.zeros(0)

    def draw(self, camera_T_parent: Array) -> Picture:
        """See `Drawer`."""
        self._twist = torch.zeros(6, device="cuda", requires_grad=True)
        camera = (torch.eye(4, device="cuda") + _hat(self._twist)) @ _cuda(camera_T_parent)
        layers = [self._layer(camera, *mesh) for mesh in self._meshes]
        self._picture = sum(layers[1:], start=layers[0]) + self._background[:, None, None]
        drawn = bool((self._picture.detach() != self._background[:, None, None]).any())
        self.box = Box(0, self.width - 1, 0, self.height - 1) if drawn else None
        if not drawn:
            return np.zeros((len(self._background), 0, 0), np.float32)
        return np.ascontiguousarray(self._picture.detach().cpu().numpy())

    def pull(self, slope: Picture) -> Array:
        """See `Drawer`."""
        if self.box is None:
            return np.zeros(6)
        (by_twist,) = torch.autograd.grad(self._picture, self._twist, _cuda(slope))
        return by_twist.cpu().numpy().astype(float)

    def _layer(self, camera: Tensor, points: Tensor, faces: Tensor, colours: Tensor) -> Tensor:
        """One mesh's colours minus the background (C, H, W), rows from the top."""
        clip = (points @ camera.T @ self._projection.T)[None].contiguous()
        shown, _ = self._rasterizer.rasterize(self._context, clip, faces, (self.height, self.width))
        flat, _ = self._rasterizer.interpolate((colours - self._background)[None].contiguous(), shown, faces)
        smooth = self._rasterizer.antialias(flat * (shown[..., 3:] > 0), shown, clip, faces)
        return torch.movedim(smooth[0], -1, 0)


def _cuda(values: NDArray[Any]) -> Tensor:
    return torch.as_tensor(np.ascontiguousarray(values), dtype=torch.float32, device="cuda")


def _projection(K: Array, width: int, height: int) -> Array:
    """From OpenCV's camera, pixel centres at integers, to clip coordinates whose first row is the picture's top."""
    depth = np.array([(_FAR_M + _NEAR_M), -2 * _FAR_M * _NEAR_M]) / (_FAR_M - _NEAR_M)
    return np.array(
        [
            [2 * K[0, 0] / width, 2 * K[0, 1] / width, 2 * (K[0, 2] + 0.5) / width - 1, 0],
            [0, 2 * K[1, 1] / height, 2 * (K[1, 2] + 0.5) / height - 1, 0],
            [0, 0, *depth],
            [0, 0, 1, 0],
        ]
    )


def _on_cuda(mesh: RenderMesh, colours: Picture, parent_T_link: Array) -> tuple[Tensor, Tensor, Tensor]:
    """Homogeneous points (3F, 4) of the parent frame, faces (F, 3) and colours (3F, C): no face shares a corner, so
    that parts keep their own colours.
    """
    points = np.ones((mesh.vertices.shape[1], 4))
    points[:, :3] = mesh.vertices.T
    for link, (first, last) in enumerate(pairwise(mesh.vertex_start)):
        points[first:last] = points[first:last] @ parent_T_link[link].T
    corners = mesh.faces.reshape(-1)
    faces = torch.arange(len(corners), dtype=torch.int32, device="cuda").reshape(-1, 3)
    return _cuda(points[corners]), faces, _cuda(np.repeat(colours[mesh.face_part], 3, axis=0))


def _hat(twist: Tensor) -> Tensor:
    """The matrix (4, 4) of a twist [phi, rho]."""
    x, y, z, u, v, w = twist
    zero = torch.zeros_like(x)
    rows = [[zero, -z, y, u], [z, zero, -x, v], [-y, x, zero, w], [zero] * 4]
    return torch.stack([torch.stack(row) for row in rows])
