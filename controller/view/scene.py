"""The body on its ground in 3-D: links and their goals, path, waypoints, and where the body was."""

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import trimesh
import viser
from scipy.spatial.transform import Rotation

from snakewalk.config import colours
from snakewalk.config.arrays import Bools, Floats
from snakewalk.config.colours import rgb
from snakewalk.config.ground import water_surface_m
from snakewalk.config.heightfield import HeightField, surface
from snakewalk.controller.kinematics.legs import leg_segments_m
from snakewalk.controller.kinematics.links import BodyView, body_in_world
from snakewalk.controller.pose.sample import quaternion_of
from snakewalk.controller.runlog.record import POSE_CHECK, Header, RunRecord
from snakewalk.drivers.types import BodyPose
from snakewalk.sim.physics.solids import Solid, solids

_HEAD = colours.rgb(colours.HEAD)
_LINKS = ((26, 70, 128), (60, 118, 180)), ((30, 104, 52), (84, 168, 96))
"""Two colours in turn, of the first run in a page and of the second."""
_HOT = (214, 32, 38)
_GOAL = rgb(colours.GOAL)
_PATH = rgb(colours.PATH)
_OLD_PATH = rgb(colours.GREY)
_TRAIL = rgb(colours.CENTRE)
_WATER = (140, 204, 235)
_WAYPOINT = rgb(colours.TO_COME)
_REACHED_COLOUR = rgb(colours.REACHED)
_GROUND = np.array([rgb(colours.LOWLAND), rgb(colours.HIGHLAND)])
"""Colours (ours); a link's hot at full current, the ground's from lowest to highest."""
_CONTOUR = (92, 84, 66)
_CONTOUR_ABOVE_M = 0.002
_CONTOURS = 12
"""Most contours of a ground (ours)."""
_LINE_HEIGHT_M = 0.006
"""Height of lines above the ground, so that they are visible (ours)."""
_GOAL_ABOVE, _GOAL_WIDTH = 1.4, 0.14
"""Height above the body's axis and thickness of the line of the goals, in radii of the body
(ours)."""
_LINE = 3.0
_FLOOR_M = 12.0
"""Side of the piece of a flat floor that is drawn (ours)."""
_TRAIL_POINTS = 400
_VISIBLE_M = 60.0
_RAY_STEP_M = 0.02
"""Reach of a click, and the steps in which the ground is searched (ours)."""


class BodyScene:
    """Drawn objects of one run; everything moves below one frame, which can follow the body."""

    def __init__(self, server: viser.ViserServer, header: Header, number: int = 0) -> None:
        """Draw ground and waypoints; ``number`` is that of the run in its page."""
        self._server = server
        self._scene = server.scene
        self._header = header
        self._is_measured = header.pose_evidence.is_measured
        self._frames_body = False
        self._root = f"/run{number}"
        self.aside_m: Floats = np.zeros(3)
        """(3,) offset of all objects: for another run that is drawn next to it."""
        self._robot = header.robot
        self._ground = header.ground
        self._limit_a = header.run.safety.current_limit_of_a(header.robot)
        self._frame = self._scene.add_frame(self._root, show_axes=False)
        self._marks = f"{self._root}/marks"
        self.switches: dict[str, viser.SceneNodeHandle] = {
            "waypoints, path and trail": self._scene.add_frame(self._marks, show_axes=False)
        }
        """Nodes that a user may hide, by their labels."""
        self._paths = 0
        self._reached = -1
        self._waypoints_m: Floats = np.zeros((0, 2))
        self._waypoints: list[viser.MeshHandle] = []
        self._axes = self._draw_axes() if header.backend == POSE_CHECK else None
        self._scene.set_up_direction("+z")
        self._draw_ground()
        draw_water(self._scene, f"{self._root}/water", water_surface_m(header.world, self._ground))
        self._draw_obstacle()
        links = self._robot.link_count
        colors = [_LINKS[number % 2][k % 2] for k in range(links)]
        self._colors = np.array([_HEAD, *colors[1:]], dtype=float)
        radii_m = np.array(self._robot.radii_m(links))
        self._goal_above_m = float(radii_m.max()) * _GOAL_ABOVE
        self._body = self._links("body", self._colors.astype(np.uint8), radii_m, 0.94)
        line_m = np.full(links, _GOAL_WIDTH * float(radii_m.max()))
        self._goals = self._links("goals", np.array(_GOAL, dtype=np.uint8), line_m, 1.0)
        self._legs = self._leg_links() if self._robot.limbs else None
        self._joint_of = np.minimum(np.arange(links), links - 2)

    def _draw_axes(self) -> viser.FrameHandle:
        """Draw the axes of the ground, and return those of the head: x red, y green, z blue."""
        length_m = 0.3 * self._robot.length_m
        for name in ("ground", "head"):
            axes = self._scene.add_frame(
                f"{self._root}/axes_{name}", axes_length=length_m, axes_radius=0.02 * length_m
            )
            self.switches[f"axes of the {name}"] = axes
        return axes

    def show(self, record: RunRecord, cycle: int, pose: int, *, follow: bool, goals: bool) -> None:
        """Draw the body at a row of the cycles and of the poses."""
        where = record.pose
        rows = record.cycle
        spine = self._robot.link_count - 1
        head = BodyPose(0.0, where.head_m[pose], where.rotation[pose])
        if not np.isfinite(head.head_in_world_m).all():
            return
        measured = body_in_world(self._robot, head, np.nan_to_num(rows.measured_rad[cycle, :spine]))
        _place(self._body, measured)
        if self._axes is not None:
            self._axes.position = tuple(head.head_in_world_m)
            self._axes.wxyz = quaternion_of(head.rotation)
        load = np.nan_to_num(np.abs(rows.current_a[cycle, :spine])) / self._limit_a
        share = np.clip(load, 0.0, 1.0)[self._joint_of, None]
        shown = self._colors + share * (np.array(_HOT) - self._colors)
        self._body.batched_colors = shown.astype(np.uint8)
        if self._legs is not None:
            _place_legs(
                self._legs,
                leg_segments_m(self._robot, measured, np.nan_to_num(rows.measured_rad[cycle])),
            )
        self._goals.visible = goals
        if goals:
            sent = np.nan_to_num(rows.sent_rad[cycle, :spine])
            _place(self._goals, body_in_world(self._robot, head, sent), self._goal_above_m)
        if follow:
            self._frame.position = tuple(self.aside_m - [*measured.centre_m[:2], 0.0])
        if self._frames_body:
            self._frames_body = False
            self._frame_body(measured)
        self._show_waypoints(
            record.waypoints_at(float(rows.time_s[cycle])), int(where.target[pose])
        )

    def show_paths(self, paths: tuple[tuple[float, Floats], ...], time_s: float) -> None:
        """Draw the path in force at a time, and those that were laid before it in grey."""
        laid = sum(since_s <= time_s for since_s, _ in paths)
        if laid == self._paths:
            return
        self._paths = laid
        for number, (_, points_m) in enumerate(paths):
            name = f"{self._marks}/paths/{number}"
            if number < laid and len(points_m) > 1:
                new = number == laid - 1
                self._line(name, points_m, _PATH if new else _OLD_PATH, _LINE if new else 1.5)
            else:
                self._scene.remove_by_name(name)

    def show_trail(self, centre_m: Floats) -> None:
        """Draw where the centre of the body, (n, 3), has been."""
        finite_values = centre_m[np.isfinite(centre_m).all(axis=1)]
        step = max(1, len(finite_values) // _TRAIL_POINTS)
        if len(finite_values) > step:
            self._line(f"{self._marks}/trail", finite_values[::step, :2], _TRAIL, 2.0)

    def ground_m(
        self, origin_m: Sequence[float], direction: Sequence[float]
    ) -> tuple[float, float] | None:
        """X and y of the drawn ground where a ray of the page meets it; None where it does not."""
        at_m = np.asarray(origin_m, float) - self._frame.position
        return ground_hit_m(self._ground, at_m, direction)

    def release(self) -> None:
        """Put the ground back where it is: the camera no longer follows."""
        self._frame.position = tuple(self.aside_m)

    def hide_ground(self, hidden: bool) -> None:
        """Leave the ground to another run, whose own is the same and lies there."""
        self._floor.visible = not hidden

    def first_camera(self) -> None:
        """Have the camera frame the body when it is first shown."""
        self._frames_body = True

    def _frame_body(self, body: BodyView) -> None:
        """Look along the body from behind and above: it fills half of the picture."""
        centre_m = body.centre_m + self._frame.position
        ahead = body.link_m[0, :2] - body.link_m[-1, :2]
        ahead /= max(float(np.linalg.norm(ahead)), 1e-9)
        forward, left = np.array([*ahead, 0.0]), np.array([-ahead[1], ahead[0], 0.0])
        length_m = self._robot.length_m
        at_m = centre_m + 0.15 * length_m * forward
        eye_m = centre_m + length_m * (-0.65 * forward + 0.35 * left + np.array([0.0, 0.0, 0.55]))
        first = self._server.initial_camera
        first.position, first.look_at = tuple(eye_m), tuple(at_m)
        for client in self._server.get_clients().values():
            client.camera.position, client.camera.look_at = tuple(eye_m), tuple(at_m)

    def _links(
        self, name: str, colors: np.ndarray, radii_m: Floats, share: float
    ) -> viser.BatchedMeshHandle:
        """One mesh for all links: a cylinder along x, drawn to their lengths and radii."""
        lengths_m = np.array(self._robot.link_lengths_m)
        return self._cylinders(name, share * lengths_m, radii_m, colors)

    def _leg_links(self) -> viser.BatchedMeshHandle:
        joints = self._robot.limb_joints
        limbs = self._robot.limbs
        lengths_m = np.array([limbs[joint.pair].segments_m[joint.place] for joint in joints])
        radii_m = np.array([limbs[joint.pair].foot_radius_m for joint in joints])
        colors = self._colors[1 + np.arange(len(joints)) % 2].astype(np.uint8)
        return self._cylinders("legs", lengths_m, radii_m, colors)

    def _cylinders(
        self, name: str, lengths_m: Floats, radii_m: Floats, colors: np.ndarray
    ) -> viser.BatchedMeshHandle:
        """One mesh for cylinders along x of these lengths (n,) and radii (n,)."""
        mesh = trimesh.creation.cylinder(1.0, 1.0, sections=20)
        return self._scene.add_batched_meshes_simple(
            f"{self._root}/{name}",
            np.asarray(mesh.vertices)[:, [2, 0, 1]],  # the cylinder stands along z
            np.asarray(mesh.faces),
            batched_wxyzs=np.tile([1.0, 0.0, 0.0, 0.0], (len(lengths_m), 1)),
            batched_positions=np.zeros((len(lengths_m), 3)),
            batched_scales=np.column_stack([lengths_m, radii_m, radii_m]),
            batched_colors=colors,
            flat_shading=False,
            lod="off",
            cast_shadow=False,
        )

    def _draw_ground(self) -> None:
        if self._ground is None:
            self._floor: viser.SceneNodeHandle = self._scene.add_grid(
                f"{self._root}/ground",
                _FLOOR_M,
                _FLOOR_M,
                cell_size=0.25,
                section_size=1.0,
                cell_color=(214, 211, 202),
                section_color=(186, 182, 172),
                plane_color=(232, 230, 222),
                plane_opacity=1.0,
                position=(0.0, 0.0, -0.001),
            )
            return
        self._floor = self._scene.add_mesh_trimesh(
            f"{self._root}/ground", ground_mesh(self._ground)
        )
        lines_m = contours_m(self._ground, contour_step_m(self._ground))
        if len(lines_m):
            self.switches["contours"] = self._scene.add_line_segments(
                f"{self._root}/ground/contours",
                lines_m + np.array([0.0, 0.0, _CONTOUR_ABOVE_M]),
                _CONTOUR,
                thickness=1.5,
                thickness_units="screen",
            )

    def _draw_obstacle(self) -> None:
        thing = self._header.world.obstacle
        if thing is None:
            return
        parts = solids(thing)
        meshes = [_mesh_of(part) for part in parts]
        starts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes[:-1])])
        *color, opacity = parts[0].colour
        self._scene.add_mesh_simple(
            f"{self._root}/obstacle",
            np.concatenate([mesh.vertices for mesh in meshes]),
            np.concatenate([mesh.faces + k for mesh, k in zip(meshes, starts, strict=True)]),
            color=np.array(color),
            opacity=opacity if opacity < 1.0 else None,
            side="double",
        )

    def _show_waypoints(self, waypoints_m: Floats, reached: int) -> None:
        """Draw the current waypoints (w, 2), and mark the reached ones."""
        if waypoints_m is not self._waypoints_m:
            self._waypoints_m = waypoints_m
            self._reached = -1
            self._draw_waypoints()
        if reached != self._reached:
            self._reached = reached
            for number, waypoint in enumerate(self._waypoints):
                waypoint.color = _REACHED_COLOUR if number < reached else _WAYPOINT

    def _draw_waypoints(self) -> None:
        for waypoint in self._waypoints:
            waypoint.remove()
        self._waypoints = []
        radius_m = self._header.plan.waypoint_radius_m
        disc = trimesh.creation.cylinder(radius_m, _LINE_HEIGHT_M)
        heights_m = self._height_m(self._waypoints_m)
        for number, (point_m, z_m) in enumerate(zip(self._waypoints_m, heights_m, strict=True)):
            position = (float(point_m[0]), float(point_m[1]), float(z_m))
            name = f"{self._marks}/waypoints/{number}"
            self._waypoints.append(
                self._scene.add_mesh_simple(
                    name,
                    np.asarray(disc.vertices),
                    np.asarray(disc.faces),
                    color=_WAYPOINT,
                    opacity=0.35,
                    wireframe=not self._is_measured,
                    position=position,
                )
            )
            self._scene.add_label(f"{name}/label", str(number + 1), position=(0.0, 0.0, 0.02))

    def _line(self, name: str, points_m: Floats, color: tuple[int, int, int], width: float) -> None:
        flat = points_m[:, :2]
        raised = np.column_stack([flat, self._height_m(flat) + _LINE_HEIGHT_M])
        segments = np.array(list(pairwise(raised)))
        self._scene.add_line_segments(
            name, segments, color, thickness=width, thickness_units="screen"
        )

    def _height_m(self, points_m: Floats) -> Floats:
        return _height_m(self._ground, points_m)


def draw_water(scene: viser.SceneApi, name: str, surface_m: tuple[Floats, Floats] | None) -> None:
    """Draw a surface of water with a centre (3,) and a size (2,), if there is one."""
    if surface_m is not None:
        middle_m, size_m = surface_m
        scene.add_box(
            name,
            color=_WATER,
            dimensions=(*size_m.tolist(), 0.002),
            opacity=0.25,
            position=tuple(middle_m),
            cast_shadow=False,
        )


def ground_hit_m(
    ground: HeightField | None, at_m: Floats, direction: Sequence[float]
) -> tuple[float, float] | None:
    """X and y where a ray from ``at_m`` (3,) meets the drawn ground; None where it does not."""
    along = np.asarray(direction, float) / max(float(np.linalg.norm(direction)), 1e-9)
    points_m = at_m + np.arange(0.0, _VISIBLE_M, _RAY_STEP_M)[:, None] * along
    above_m = points_m[:, 2] - _height_m(ground, points_m[:, :2])
    below = np.flatnonzero((above_m <= 0.0) & _is_drawn(ground, points_m[:, :2]))
    if not len(below) or below[0] == 0:
        return None
    before, behind = above_m[below[0] - 1 : below[0] + 1]
    if before <= 0.0:  # from below, or through the border
        return None
    ground_point = points_m[below[0]] - along * _RAY_STEP_M * behind / (behind - before)
    return float(ground_point[0]), float(ground_point[1])


def _is_drawn(ground: HeightField | None, points_m: Floats) -> Bools:
    """Which of points (n, 2) lie on the ground that is drawn."""
    if ground is None:
        return np.asarray((np.abs(points_m) <= 0.5 * _FLOOR_M).all(axis=1))
    return ground.contains(points_m[:, 0], points_m[:, 1])


def _height_m(ground: HeightField | None, points_m: Floats) -> Floats:
    if ground is None:
        return np.zeros(len(points_m))
    return ground.elevation_m(points_m[:, 0], points_m[:, 1])


def _place(links: viser.BatchedMeshHandle, body: BodyView, above_m: float = 0.0) -> None:
    links.batched_positions = (body.link_m + np.array([0.0, 0.0, above_m])).astype(np.float32)
    turns = Rotation.from_matrix(body.rotation).as_quat()
    links.batched_wxyzs = turns[:, [3, 0, 1, 2]].astype(np.float32)


def _place_legs(legs: viser.BatchedMeshHandle, ends_m: Floats) -> None:
    along = ends_m[:, 1] - ends_m[:, 0]
    along /= np.linalg.norm(along, axis=1, keepdims=True)
    half = np.column_stack([1.0 + along[:, 0], np.zeros(len(along)), -along[:, 2], along[:, 1]])
    half[half[:, 0] < 1e-9] = 0.0, 0.0, 0.0, 1.0  # straight back: any half turn
    legs.batched_positions = ends_m.mean(axis=1).astype(np.float32)
    turns = half / np.linalg.norm(half, axis=1, keepdims=True)
    legs.batched_wxyzs = turns.astype(np.float32)


def _mesh_of(part: Solid) -> trimesh.Trimesh:
    place = np.eye(4)
    place[:3, :3], place[:3, 3] = part.axes, part.centre_m
    if part.kind == "box":
        mesh: trimesh.Trimesh = trimesh.creation.box(2.0 * np.array(part.half_m))
    else:
        radius_m, half_m = part.half_m
        mesh = trimesh.creation.cylinder(radius_m, 2.0 * half_m, sections=32)
    mesh.apply_transform(place)
    return mesh


def ground_mesh(field: HeightField) -> trimesh.Trimesh:
    """Return the ground, coloured by height."""
    corners_m, faces = surface(field)
    height = corners_m[:, 2]
    share = (height - height.min()) / max(float(np.ptp(height)), 1e-9)
    colors = _GROUND[0] + share[:, None] * (_GROUND[1] - _GROUND[0])
    return trimesh.Trimesh(
        corners_m,
        faces,
        vertex_colors=np.column_stack([colors, np.full(len(colors), 255.0)]).astype(np.uint8),
        process=False,
    )


def contour_step_m(field: HeightField) -> float:
    """Return a round difference in height (1, 2 or 5) that gives at most 12 contours."""
    least_m = max(float(np.ptp(field.z_m)) / _CONTOURS, 1e-4)
    power = 10.0 ** math.floor(math.log10(least_m))
    return next(step * power for step in (1.0, 2.0, 5.0, 10.0) if step * power >= least_m)


def contours_m(field: HeightField, step_m: float) -> Floats:
    """Pieces (n, 2, 3) of the contours at multiples of a height; they lie in the triangles."""
    corners_m, faces = surface(field)
    height = corners_m[:, 2]
    first, last = math.ceil(height.min() / step_m), math.floor(height.max() / step_m)
    result = []
    for level_m in step_m * np.arange(first, last + 1):
        above = height > level_m
        count = above[faces].sum(axis=1)
        cut = faces[(count == 1) | (count == 2)]
        # the corner that is alone on its side of the level comes first
        is_alone = above[cut] == (above[cut].sum(axis=1) == 1)[:, None]
        turned = (np.argmax(is_alone, axis=1)[:, None] + np.arange(3)) % 3
        alone, *others = np.moveaxis(corners_m[np.take_along_axis(cut, turned, axis=1)], 1, 0)
        ends = []
        for other in others:
            share = (level_m - alone[:, 2]) / (other[:, 2] - alone[:, 2])
            ends.append(alone + share[:, None] * (other - alone))
        result.append(np.stack(ends, axis=1))
    return np.concatenate(result) if result else np.zeros((0, 2, 3))
