"""The scene: an arm of any URDF, gripper, table, workpiece, tag on the flange, clutter, lights, background.

World = the frame in which the arm's joints are given (`base_link`). Links are placed by our own forward
kinematics, so lengths are exact; each material of a link is one mesh.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hecbench import se3
from hecbench.recording import CameraModel
from hecbench.robots.model import RobotModel
from hecbench.se3 import Array
from hecbench.targets import AprilTagTarget
from hecbench_hardware.lab import tag
from hecbench_hardware.trials import solids

_ROBOT_GROUP, _OTHER_GROUP = 1, 0
_TABLE_HALF_M = (0.8, 0.9, 0.02)
_TABLE_CENTRE_M = (0.45, 0.0)
_WALL_DISTANCE_M = 1.6
_CLUTTER = 14
NEAR_M, FAR_M = 0.1, 30.0
"""What is drawn, along the optical axis."""
_PLATE_BEHIND_TAG_M = 3e-4


@dataclass(frozen=True, eq=False)
class Surroundings:
    """What else is in the picture.

    Attributes:
        seed: of clutter, background and colours.
        shadows: cast by the lamp.
        clutter: boxes and cylinders behind the arm, and a patterned wall.
        base_T_room: (4, 4), where the table, its top at z = 0 and its front along x, stands.
    """

    seed: int = 0
    shadows: bool = True
    clutter: bool = True
    base_T_room: Array = field(default_factory=lambda: np.eye(4))


@dataclass(frozen=True, eq=False)
class FlangeTag:
    """A tag carried by the flange."""

    target: AprilTagTarget
    flange_T_tag: Array


class Scene:
    """A MuJoCo model of the cell and its present state."""

    def __init__(
        self,
        robot: RobotModel,
        *,
        joint_names: tuple[str, ...],
        base_link: str,
        flange_link: str,
        gripper: solids.Gripper | None = None,
        peg_of: solids.Gripper | None = None,
        flange_tag: FlangeTag | None = None,
        workpiece: bool = False,
        surroundings: Surroundings | None = None,
    ) -> None:
        """Build it; `gripper` draws boxes for one whose meshes the robot does not have, `peg_of` the peg in it."""
        import mujoco

        self.robot, self.joint_names, self.base_link = robot, joint_names, base_link
        self._flange = robot.link_index(flange_link)
        spec = mujoco.MjSpec()
        spec.visual.headlight.ambient = [0.35] * 3
        spec.visual.headlight.diffuse = [0.25] * 3
        spec.visual.headlight.specular = [0.0] * 3
        spec.visual.quality.shadowsize = 2048
        spec.visual.quality.offsamples = 0
        _room(spec, surroundings or Surroundings())
        self._links = self._add_links(spec)
        if gripper is not None:
            self._add_on_flange(spec, "gripper", gripper.flange_T_tool, gripper.solids(), (0.2, 0.2, 0.22))
        if peg_of is not None:
            self._add_on_flange(spec, "peg", peg_of.flange_T_tool, (solids.peg(),), (0.8, 0.75, 0.3))
        if flange_tag is not None:
            body = spec.worldbody.add_body(name="flange_tag", mocap=True)
            _add_tag(spec, body, "flange_tag", flange_tag.target, np.eye(4))
        if workpiece:
            self._add_workpiece(spec)
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        self._flange_tag = flange_tag
        self._on_flange = {"gripper": gripper, "peg": peg_of}
        self._view = mujoco.MjvScene(self.model, maxgeom=self.model.ngeom + 100)
        self._option = mujoco.MjvOption()
        self._camera = mujoco.MjvCamera()
        self.robot_geoms = np.array([group == _ROBOT_GROUP for group in self.model.geom_group])

    # state

    def place(
        self, joints_rad: Array, base_T_workpiece: Array | None = None, fingers_rad: float = 0.0
    ) -> None:
        """Move the arm, with what it carries, to joints (J,) rad, and the workpiece to a pose (4, 4).

        `fingers_rad` goes to the joints of the model that are not the arm's.
        """
        import mujoco

        others = tuple(name for name in self.robot.joint_names if name not in self.joint_names)
        joints = np.append(joints_rad, [fingers_rad] * len(others))
        base_T_link = self.robot.link_poses(joints, self.joint_names + others, frame=self.base_link)
        for name, index in self._links.items():
            self._put(name, base_T_link[index])
        base_T_flange = base_T_link[self._flange]
        for name, held in self._on_flange.items():
            if held is not None:
                self._put(name, base_T_flange @ held.flange_T_tool)
        if self._flange_tag is not None:
            self._put("flange_tag", base_T_flange @ self._flange_tag.flange_T_tag)
        if base_T_workpiece is not None:
            self._put("workpiece", base_T_workpiece)
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_camlight(self.model, self.data)

    def _put(self, body: str, base_T_body: Array) -> None:
        mocap = self.model.body_mocapid[self.model.body(body).id]
        self.data.mocap_pos[mocap] = base_T_body[:3, 3]
        self.data.mocap_quat[mocap] = se3.to_quat_wxyz(base_T_body)

    def view(self, camera: CameraModel, base_T_camera: Array, *, segmented: bool = False) -> Any:
        """The MuJoCo scene as a pinhole camera without distortion sees it, exactly by its K."""
        import mujoco

        every = mujoco.mjtCatBit.mjCAT_ALL
        mujoco.mjv_updateScene(self.model, self.data, self._option, None, self._camera, every, self._view)
        (fx, _, cx), (_, fy, cy), _ = camera.intrinsics.tolist()
        left, right = (-0.5 - cx) / fx, (camera.width - 0.5 - cx) / fx
        top, bottom = (0.5 + cy) / fy, (0.5 + cy - camera.height) / fy
        for eye in self._view.camera:
            eye.pos, eye.forward, eye.up = base_T_camera[:3, 3], base_T_camera[:3, 2], -base_T_camera[:3, 1]
            eye.frustum_near, eye.frustum_far = NEAR_M, FAR_M
            eye.frustum_top, eye.frustum_bottom = NEAR_M * top, NEAR_M * bottom
            eye.frustum_center = NEAR_M * (left + right) / 2
            eye.frustum_width = NEAR_M * (right - left) / 2
        self._view.flags[mujoco.mjtRndFlag.mjRND_SEGMENT] = segmented
        self._view.flags[mujoco.mjtRndFlag.mjRND_IDCOLOR] = segmented
        return self._view

    def is_robot(self, id_image: NDArray[np.uint8]) -> NDArray[np.bool_]:
        """(H, W) True on the robot, from a segmented picture (H, W, 3)."""
        channels = id_image.astype(np.int32)
        segment = channels[..., 0] + (channels[..., 1] << 8) + (channels[..., 2] << 16)
        robot = np.zeros(self._view.ngeom + 1, bool)
        for geom in self._view.geoms[: self._view.ngeom]:
            robot[geom.segid + 1] = geom.objid >= 0 and self.robot_geoms[geom.objid]
        return np.asarray(robot[np.minimum(segment, self._view.ngeom)])

    # building

    def _add_links(self, spec: Any) -> dict[str, int]:
        links = {}
        for number, part in enumerate(self.robot.parts):
            if part.link not in links:
                links[part.link] = self.robot.link_index(part.link)
                spec.worldbody.add_body(name=part.link, mocap=True)
            name = f"robot {number}"
            _add_mesh(spec, name, part.vertices, part.faces)
            _add_mesh_geom(spec.body(part.link), name, part.colour, _ROBOT_GROUP)
        return links

    def _add_on_flange(
        self, spec: Any, name: str, flange_T_body: Array, parts: Any, colour: tuple[float, float, float]
    ) -> None:
        body = spec.worldbody.add_body(name=name, mocap=True)
        for solid in parts:
            add_solid(body, solid, colour, group=_ROBOT_GROUP)

    def _add_workpiece(self, spec: Any) -> None:
        body = spec.worldbody.add_body(name="workpiece", mocap=True)
        for solid in solids.workpiece(solids.CLEARANCE_M):
            if solid.name != "tag plate":
                add_solid(body, solid, (0.75, 0.45, 0.2) if solid.name == "block" else (0.45, 0.5, 0.55))
        _add_tag(spec, body, "tag", solids.TAG, solids.workpiece_T_tag())


def _add_tag(spec: Any, body: Any, name: str, target: AprilTagTarget, body_T_tag: Array) -> None:
    """The squares of a tag on a plate."""
    import mujoco

    for white, (vertices, faces) in tag.meshes(target).items():
        mesh = f"{name} {'white' if white else 'black'}"
        _add_mesh(spec, mesh, se3.transform_points(body_T_tag, vertices), faces)
        _add_mesh_geom(body, mesh, (0.92,) * 3 if white else (0.06,) * 3, _OTHER_GROUP)
    half = solids.PLATE_HALF_M[0] * target.size_m / solids.TAG.size_m, solids.PLATE_HALF_M[2]
    centre = body_T_tag[:3, 3] + (half[1] + _PLATE_BEHIND_TAG_M) * body_T_tag[:3, 2]
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_BOX,
        size=[half[0], half[0], half[1]],
        pos=centre,
        quat=se3.to_quat_wxyz(body_T_tag),
        rgba=[0.92, 0.92, 0.92, 1],
        contype=0,
        conaffinity=0,
        group=_OTHER_GROUP,
    )


def _add_mesh(spec: Any, name: str, vertices: Array, faces: Any) -> None:
    import mujoco

    mesh = spec.add_mesh(name=name)
    mesh.uservert, mesh.userface = vertices.ravel(), faces.ravel()
    mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL


def _add_mesh_geom(body: Any, mesh: str, colour: tuple[float, ...], group: int) -> None:
    import mujoco

    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_MESH,
        meshname=mesh,
        rgba=[*colour, 1],
        contype=0,
        conaffinity=0,
        group=group,
    )


def add_solid(
    body: Any, solid: solids.Solid, colour: tuple[float, float, float], group: int = _OTHER_GROUP
) -> None:
    """Draw a solid; it takes part in no collision."""
    from hecbench_hardware.trials import sweep

    geom = sweep.add_solid(body, solid, contype=0, conaffinity=0, group=group)
    geom.rgba = [*colour, 1]


def _room(spec: Any, surroundings: Surroundings) -> None:
    """Table, floor, walls, lamps and clutter."""
    import mujoco

    rng = np.random.default_rng(surroundings.seed)
    place = surroundings.base_T_room
    world = spec.worldbody.add_body(name="room", pos=place[:3, 3], quat=se3.to_quat_wxyz(place))
    world.add_light(
        pos=[1.5, -1.5, 3.0],
        dir=[-0.45, 0.5, -1.0],
        type=mujoco.mjtLightType.mjLIGHT_DIRECTIONAL,
        castshadow=surroundings.shadows,
        diffuse=[0.5] * 3,
        specular=[0.1] * 3,
    )
    texture = spec.add_texture(
        name="pattern",
        type=mujoco.mjtTexture.mjTEXTURE_2D,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_CHECKER,
        mark=mujoco.mjtMark.mjMARK_RANDOM,
        random=0.2,
        width=512,
        height=512,
        rgb1=[0.52, 0.5, 0.47],
        rgb2=[0.6, 0.58, 0.55],
        markrgb=[0.3, 0.32, 0.35],
    )
    material = spec.add_material(name="pattern", texuniform=True, texrepeat=[1.5, 1.5], specular=0.0)
    textures = material.textures
    textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = texture.name
    material.textures = textures
    spec.add_material(name="table", rgba=[0.42, 0.36, 0.3, 1], specular=0.0)
    hidden = {"contype": 0, "conaffinity": 0, "group": _OTHER_GROUP}
    box, plane = mujoco.mjtGeom.mjGEOM_BOX, mujoco.mjtGeom.mjGEOM_PLANE
    world.add_geom(
        type=box,
        size=_TABLE_HALF_M,
        pos=[*_TABLE_CENTRE_M, -_TABLE_HALF_M[2]],
        material="table",
        **hidden,
    )
    world.add_geom(type=plane, size=[6, 6, 1], pos=[0, 0, -0.8], material="pattern", **hidden)
    if not surroundings.clutter:
        return
    wall = se3.to_quat_wxyz(se3.make(np.array([[0, 0, 1.0], [1, 0, 0], [0, 1, 0]]), np.zeros(3)))
    world.add_geom(
        type=plane, size=[6, 6, 1], pos=[-_WALL_DISTANCE_M, 0, 1], quat=wall, material="pattern", **hidden
    )
    for _ in range(_CLUTTER):
        half = rng.uniform(0.03, 0.12, 3)
        where = [rng.uniform(-1.3, -0.55), rng.uniform(-1.3, 1.3), rng.uniform(-0.6, 0.9)]
        kind = box if rng.random() < 0.6 else mujoco.mjtGeom.mjGEOM_CYLINDER
        colour = [*rng.uniform(0.1, 0.9, 3), 1]
        world.add_geom(type=kind, size=half, pos=where, rgba=colour, **hidden)
