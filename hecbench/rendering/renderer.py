"""Draw a robot by an exact pinhole camera: colour, coverage, depth, link and part, and how the image moves.

The image is anti-aliased from the mesh's own edges: where a visible edge crosses between two pixel centres, the two
pixels exchange what a straight edge would cover. The same crossings carry the derivative, so that image and
derivative agree and only a few thousand pixels matter.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hecbench.errors import InputError
from hecbench.rendering import crossing_kernels, kernels, shading
from hecbench.rendering.crossings import CrossingBuffers, Crossings, Edges
from hecbench.rendering.mesh import Float, Int, RenderMesh
from hecbench.rendering.smooth import Normals, normals


class Scene(NamedTuple):
    """What the rasteriser draws: a mesh, see `RenderMesh`, and the camera."""

    vertices: Float
    vertex_start: Int
    planes: Float
    face_start: Int
    faces: Int
    K: Float
    """fx, skew, cx, fy, cy with pixel centres at +0.5."""


class Sight(NamedTuple):
    """What the rasteriser writes."""

    camera_T_link: Float
    """(L, 3, 4)"""
    screen: Float
    """(3, V): u, v, and 1/z, which is 0 where a vertex is nearer than the near plane."""
    front: NDArray[np.bool_]
    """(F,) which faces face the camera."""
    order: Int
    """Scratch."""
    nearness: Float
    """(H, W) 1/m, 0 where nothing is."""
    face: Int
    """(H, W), -1 where nothing is."""
    box: Int
    """x0, x1, y0, y1 (inclusive) of the pixels that were covered."""


@dataclass(eq=False)
class Renderer:
    """Buffers for one mesh and one camera; every call overwrites the arrays that the last one returned.

    Args:
        mesh: what to draw.
        K: (3, 3) px in OpenCV's convention, pixel centres at integers.
        width: of the image, px.
        height: of the image, px.
        ambient: None draws flat colours. A number in [0, 1] lights the robot by a lamp at the camera: colours times
            ``ambient + (1 - ambient) * cosine`` of the angle between the surface's normal and the viewing ray.
    """

    mesh: RenderMesh
    K: ArrayLike
    width: int
    height: int
    ambient: float | None = None
    scene: Scene = field(init=False)
    sight: Sight = field(init=False)
    edges: Edges = field(init=False)
    nearness: Float = field(init=False)
    face: Int = field(init=False)
    box: Int = field(init=False)
    """The last three are those of `sight`."""
    painted: Int = field(init=False)
    """x0, x1, y0, y1 (inclusive) of the pixels that the last `image` touched; all others show the background."""
    dropped: int = field(default=0, init=False)
    """Front faces of the last pose that reach behind the near plane (0.05 m) and were not drawn."""

    def __post_init__(self) -> None:
        K = np.asarray(self.K, float)
        if K.shape != (3, 3) or not np.isfinite(K).all() or K[0, 0] <= 0 or K[1, 1] <= 0:
            raise InputError(f"K must be a finite 3x3 matrix with positive focal lengths, is {K.tolist()}")
        if self.width < 2 or self.height < 2:
            raise InputError(f"an image of {self.width}x{self.height} px cannot be drawn")
        if self.ambient is not None and not 0 <= self.ambient <= 1:
            raise InputError(f"ambient is a share of the light between 0 and 1, is {self.ambient}")
        mesh, shape = self.mesh, (self.height, self.width)
        self.scene = Scene(
            mesh.vertices,
            mesh.vertex_start,
            mesh.planes,
            mesh.face_start,
            mesh.faces,
            np.array([K[0, 0], K[0, 1], K[0, 2] + 0.5, K[1, 1], K[1, 2] + 0.5], np.float32),
        )
        self.sight = Sight(
            camera_T_link=np.zeros((len(mesh.vertex_start) - 1, 3, 4), np.float32),
            screen=np.zeros((3, mesh.vertices.shape[1]), np.float32),
            front=np.zeros(len(mesh.faces), np.bool_),
            order=np.zeros(2 * len(mesh.edge_ends) + len(mesh.faces) + 1, np.int32),
            nearness=np.zeros(shape, np.float32),
            face=np.full(shape, -1, np.int32),
            box=np.array([0, self.width - 1, 0, self.height - 1], np.int32),
        )
        self.nearness, self.face, self.box = self.sight[4:]
        self.edges, self._buffers = Edges.of(mesh), CrossingBuffers.of(self.width, self.height)
        self._count = 0
        self.painted = self.box.copy()
        self._background = np.full(4, np.nan, np.float32)
        self._image = np.zeros((*shape, 4), np.float32)
        self._normals: Normals | None = None if self.ambient is None else normals(mesh)
        self._shade = np.ones(shape, np.float32)
        self._slide = np.zeros((*shape, 3) if self._normals else (0, 0, 3), np.float32)
        self._derivative: Float | None = None
        self._derived = self.box.copy()

    def scale_focal(self, factor: float) -> None:
        """From now on draw with both focal lengths (and the skew) `factor` times those of K."""
        K = np.asarray(self.K, float)
        self.scene.K[[0, 1, 3]] = factor * np.array([K[0, 0], K[0, 1], K[1, 1]])

    def rasterise(self, camera_T_link: ArrayLike) -> None:
        """Only the part of `draw` that finds what each pixel centre sees: `face`, `nearness`, `depth`, `part`, `link`.

        The crossings, and with them `image`, stay those of the last `draw`.
        """
        poses = np.asarray(camera_T_link)
        if (
            poses.shape[-2:] != (4, 4)
            or len(poses) != len(self.mesh.vertex_start) - 1
            or not np.isfinite(poses).all()
        ):
            raise InputError(
                f"expected {len(self.mesh.vertex_start) - 1} finite link poses, got shape {poses.shape}"
            )
        self.sight.camera_T_link[:] = poses[:, :3]
        kernels.project(self.scene, self.sight)
        self.dropped = kernels.rasterise(self.scene, self.sight)

    def draw(self, camera_T_link: ArrayLike) -> int:
        """Rasterise the robot with its links at camera_T_link (L, 4, 4); returns the number of crossings.

        Afterwards `image`, `crossings`, `depth`, `part` and `link` belong to this pose.
        """
        self.rasterise(camera_T_link)
        count = crossing_kernels.find_crossings(self.edges, self.sight, self._buffers)
        self._count = crossing_kernels.describe_crossings(
            self.edges, self.sight, self.scene.K, count, self._buffers
        )
        return self._count

    def image(self, colours: ArrayLike | None = None, background: ArrayLike = (0, 0, 0)) -> Float:
        """The anti-aliased picture (H, W, 4) of the last pose: RGB by part (P, 3), and coverage in [0, 1]."""
        table = self._table(colours, background)
        if not np.array_equal(table[-1], self._background):
            self._image[:] = table[-1]
            self._background = table[-1].copy()
        face, face_part = self.face, self.mesh.face_part
        edges = self._buffers.ends, self._buffers.mix, self._count, self.box, self.painted
        if self._normals is None:
            crossing_kernels.compose(face, face_part, table, *edges, self._image)
        else:
            self._light(self._normals)
            shading.compose(face, face_part, table, self._shade, self._buffers.best, *edges, self._image)
        return self._image

    def image_derivative(self, colours: ArrayLike | None = None, background: ArrayLike = (0, 0, 0)) -> Float:
        """How the last pose's RGB moves by a left perturbation [phi rad, rho m] of camera_T_robot: (H, W, 3, 6).

        For the colours that `image` would be given. Edges move the pixels that they mix; with a lamp the surfaces
        between them move too. Dense, and only as fast as that; `crossings` alone hold what flat colours need.
        """
        if self._derivative is None:
            self._derivative = np.zeros((self.height, self.width, 3, 6), np.float32)
        left, right, top, bottom = self._derived
        self._derivative[max(0, top - 1) : bottom + 2, max(0, left - 1) : right + 2] = 0
        self._derived = self.box.copy()
        table, columns = self._table(colours, background), self.crossings.pose_columns()
        if self._normals is not None:
            self._light(self._normals)
            shading.surface_rates(
                self.face,
                self.mesh.face_part,
                self.nearness,
                self.scene.K,
                self.box,
                self._buffers.best,
                table,
                self._shade,
                self._slide,
                self._derivative,
            )
        shading.edge_rates(
            table, self._shade, self._buffers.ends, self._buffers.mix, columns, self._count, self._derivative
        )
        return self._derivative

    def _table(self, colours: ArrayLike | None, background: ArrayLike) -> Float:
        """RGB and coverage (P + 1, 4) of the parts, last of the background."""
        table = np.zeros((len(self.mesh.part_names) + 1, 4), np.float32)
        table[:-1, :3] = self.mesh.colours if colours is None else colours
        table[:-1, 3] = 1
        table[-1, :3] = background
        return table

    def _light(self, known: Normals) -> None:
        shading.shade_pixels(
            (
                self.sight.screen,
                self.mesh.faces,
                self.face,
                self.edges.face_link,
                known.vectors,
                known.faces,
            ),
            self.nearness,
            self.sight.camera_T_link,
            self.scene.K,
            np.float32(self.ambient or 0),
            self.box,
            self._shade,
            self._slide,
        )

    @property
    def part(self) -> NDArray[np.int32]:
        """Part (H, W) seen at each pixel centre, -1 for the background; a new array."""
        return self._seen(self.mesh.face_part)

    @property
    def link(self) -> NDArray[np.int32]:
        """Link (H, W) seen at each pixel centre, -1 for the background; a new array."""
        return self._seen(self.edges.face_link)

    def _seen(self, of_face: Int) -> Int:
        seen = np.full(self.face.shape, -1, np.int32)
        left, right, top, bottom = self.box
        area = (slice(top, bottom + 1), slice(left, right + 1))
        seen[area] = np.where(self.face[area] >= 0, of_face[self.face[area]], -1)
        return seen

    @property
    def depth(self) -> NDArray[np.float32]:
        """Depth (H, W) m along the optical axis at each pixel centre, inf for the background; a new array."""
        with np.errstate(divide="ignore"):
            return np.asarray(1 / self.nearness, np.float32)

    @property
    def crossings(self) -> Crossings:
        """The crossings of the last pose: views, valid until the next `draw`."""
        return self._buffers.first(self._count)

    @property
    def found(self) -> tuple[CrossingBuffers, int]:
        """The same for compiled loops: the buffers, and how many of their crossings are those of the last pose."""
        return self._buffers, self._count
