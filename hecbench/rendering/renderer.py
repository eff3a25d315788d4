"""Draw a robot by an exact pinhole camera: colour, coverage, depth, link and part, and how the image moves.

The image is anti-aliased from the mesh's own edges: where a visible edge crosses between two pixel centres, the two
pixels exchange what a straight edge would cover. The same crossings carry the derivative, so that image and
derivative agree and only a few thousand pixels matter.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hecbench.errors import InputError
from hecbench.rendering import kernels, shading
from hecbench.rendering.mesh import Float, Int, RenderMesh
from hecbench.rendering.smooth import Normals, normals


@dataclass(frozen=True, eq=False)
class Crossings:
    """C places where a visible edge crosses the segment between two neighbouring pixel centres p and q, at t.

    Attributes:
        pixels: (C, 2) flat indices of p and q; q is right of p or below it.
        parts: (C, 2) of p and q, -1 for the background.
        link: (C,) that the edge belongs to, and moves with.
        t: (C,) in [0, 1], px from p.
        point: (C, 3) m on the edge, camera frame.
        gradient: (C, 3) px/m: dt by the motion of the point in the camera frame.
        slope: (C,) of the edge, columns per row for horizontal pairs, rows per column for vertical ones.
        mix: (C, 4): share of q's colour in p, its derivative by -t; share of p's colour in q, its derivative by t.
    """

    pixels: Int
    parts: Int
    link: Int
    t: Float
    point: Float
    gradient: Float
    slope: Float
    mix: Float

    def __len__(self) -> int:
        return len(self.link)

    @property
    def horizontal(self) -> NDArray[np.bool_]:
        """Which pairs (C,) are horizontal."""
        return np.asarray(self.pixels[:, 1] - self.pixels[:, 0] == 1)

    def pose_columns(self) -> NDArray[np.float64]:
        """dt (C, 6) px by a left perturbation [phi rad, rho m] of camera_T_robot."""
        gradient = self.gradient.astype(float)
        return np.concatenate([np.cross(self.point.astype(float), gradient), gradient], 1)


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
    box: Int = field(init=False)
    """x0, x1, y0, y1 (inclusive) of the pixels that the robot covered in the last `draw`."""
    painted: Int = field(init=False)
    """The same of the pixels that the last `image` touched; all others show the background."""
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
        capacity = max(4096, self.width * self.height // 4)
        self._intrinsics = np.array([K[0, 0], K[0, 1], K[0, 2] + 0.5, K[1, 1], K[1, 2] + 0.5], np.float32)
        self._face_link = mesh.part_link[mesh.face_part]
        self._screen = np.zeros((3, mesh.vertices.shape[1]), np.float32)
        self._front = np.zeros(len(mesh.faces), np.bool_)
        self._order = np.zeros(2 * len(mesh.edge_ends) + len(mesh.faces) + 1, np.int32)
        self.box = np.array([0, self.width - 1, 0, self.height - 1], np.int32)
        self.painted = self.box.copy()
        self._background = np.full(4, np.nan, np.float32)
        self._best = np.zeros((2, *shape), np.int32)
        self._taken = np.zeros(2 * self.width * self.height, np.float32)
        self._pair = np.zeros(capacity, np.int32)
        self._place = np.zeros((capacity, 2), np.float32)
        self._edge = np.zeros(capacity, np.int32)
        self._ends = np.zeros((capacity, 4), np.int32)
        self._link = np.zeros(capacity, np.int32)
        self._point = np.zeros((capacity, 3), np.float32)
        self._gradient = np.zeros((capacity, 3), np.float32)
        self._slope = np.zeros(capacity, np.float32)
        self._mix = np.zeros((capacity, 4), np.float32)
        self._count = 0
        self._image = np.zeros((*shape, 4), np.float32)
        self._camera_T_link = np.zeros((len(mesh.vertex_start) - 1, 3, 4), np.float32)
        self._normals: Normals | None = None if self.ambient is None else normals(mesh)
        self._shade = np.ones(shape, np.float32)
        self._slide = np.zeros((*shape, 3) if self._normals else (0, 0, 3), np.float32)
        self._derivative: Float | None = None
        self._derived = self.box.copy()
        self.nearness = np.zeros(shape, np.float32)
        self.face = np.full(shape, -1, np.int32)

    @property
    def scene(self) -> tuple[Float | Int, ...]:
        """What `kernels.see` draws: the mesh and the camera."""
        mesh = self.mesh
        return (
            mesh.vertices,
            mesh.vertex_start,
            mesh.planes,
            mesh.face_start,
            mesh.faces,
            self._intrinsics,
        )

    @property
    def sight(self) -> tuple[NDArray[Any], ...]:
        """What `kernels.see` writes to; the last three are `nearness`, `face` and `box`."""
        return (
            self._camera_T_link,
            self._screen,
            self._front,
            self._order,
            self.nearness,
            self.face,
            self.box,
        )

    def scale_focal(self, factor: float) -> None:
        """From now on draw with both focal lengths (and the skew) `factor` times those of K."""
        K = np.asarray(self.K, float)
        self._intrinsics[[0, 1, 3]] = factor * np.array([K[0, 0], K[0, 1], K[1, 1]])

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
        mesh = self.mesh
        self._camera_T_link[:] = poses[:, :3]
        kernels.project(
            mesh.vertices,
            mesh.vertex_start,
            mesh.planes,
            mesh.face_start,
            self._camera_T_link,
            self._intrinsics,
            self._screen,
            self._front,
        )
        self.dropped = kernels.rasterise(
            self._screen, mesh.faces, self._front, self._order, self.nearness, self.face, self.box
        )

    def draw(self, camera_T_link: ArrayLike) -> int:
        """Rasterise the robot with its links at camera_T_link (L, 4, 4); returns the number of crossings.

        Afterwards `image`, `crossings`, `depth`, `part` and `link` belong to this pose.
        """
        self.rasterise(camera_T_link)
        mesh = self.mesh
        self._count = kernels.find_crossings(
            self._screen,
            mesh.edge_ends,
            mesh.edge_faces,
            mesh.edge_kinds,
            self._front,
            self._order,
            self.face,
            mesh.face_part,
            self._face_link,
            self.nearness,
            self.box,
            self._best,
            self._pair,
            self._place,
            self._edge,
        )
        self._count = kernels.describe_crossings(
            self._screen,
            mesh.edge_ends,
            mesh.edge_faces,
            self.face,
            mesh.face_part,
            self._face_link,
            self._intrinsics,
            self._pair,
            self._place,
            self._edge,
            self._count,
            self._taken,
            self._ends,
            self._link,
            self._point,
            self._gradient,
            self._slope,
            self._mix,
        )
        return self._count

    def image(self, colours: ArrayLike | None = None, background: ArrayLike = (0, 0, 0)) -> Float:
        """The anti-aliased picture (H, W, 4) of the last pose: RGB by part (P, 3), and coverage in [0, 1]."""
        table = self._table(colours, background)
        if not np.array_equal(table[-1], self._background):
            self._image[:] = table[-1]
            self._background = table[-1].copy()
        face, face_part = self.face, self.mesh.face_part
        edges = self._ends, self._mix, self._count, self.box, self.painted
        if self._normals is None:
            kernels.compose(face, face_part, table, *edges, self._image)
        else:
            self._light(self._normals)
            shading.compose(face, face_part, table, self._shade, self._best, *edges, self._image)
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
                self._intrinsics,
                self.box,
                self._best,
                table,
                self._shade,
                self._slide,
                self._derivative,
            )
        shading.edge_rates(table, self._shade, self._ends, self._mix, columns, self._count, self._derivative)
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
            (self._screen, self.mesh.faces, self.face, self._face_link, known.vectors, known.faces),
            self.nearness,
            self._camera_T_link,
            self._intrinsics,
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
        return self._seen(self._face_link)

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
        n = self._count
        return Crossings(
            pixels=self._ends[:n, :2],
            parts=self._ends[:n, 2:],
            link=self._link[:n],
            t=self._place[:n, 0],
            point=self._point[:n],
            gradient=self._gradient[:n],
            slope=self._slope[:n],
            mix=self._mix[:n],
        )
