"""A crowd in the browser: the camera flies, and keys or clicks steer one of the animals."""

from collections.abc import Callable
from queue import SimpleQueue

import numpy as np
import viser

from snakewalk.config import colours
from snakewalk.config.arrays import Floats, Ints
from snakewalk.config.ground import water_surface_m
from snakewalk.config.heightfield import HeightField
from snakewalk.config.world import WorldConfig
from snakewalk.controller.repertoire.behaviour import Wandering
from snakewalk.controller.repertoire.crowd_film import MIDDLE, DetailedCrowd
from snakewalk.controller.view.live_view import host_and_port
from snakewalk.controller.view.page_server import served_model
from snakewalk.controller.view.scene import draw_water, ground_hit_m, ground_mesh
from snakewalk.drivers.clock import WallClock
from snakewalk.sim.rendering.crowd_mesh import COLOURS, MESHES, TubeGrid

_SAMPLES = 2500
"""Samples of the drawn ground (ours): more slow a browser without a graphics card."""
FRAMES = 4
"""Frames of the repertoire between two pictures (ours): 15 a second."""
_LATE_S = 0.25
"""A page that is late by more continues with the present (ours)."""
_FASTER, _TURN, _CLIMB = 0.25, 0.3, 0.15
"""Changes for a key: share of the fastest speed, turn in rad/s, and slope in rad (ours)."""
_KEYS = {
    "I": ("faster", (1, 0, 0)),
    "K": ("slower", (-1, 0, 0)),
    "J": ("left", (0, 1, 0)),
    "L": ("right", (0, -1, 0)),
    "U": ("up", (0, 0, 1)),
    "O": ("down", (0, 0, -1)),
}
_HINT = (
    "A click on the ground sends your animal there. The keys I and K make it faster and "
    "slower, J and L turn it, U and O make it ascend and descend in water. W, A, S, D, Q and E "
    "fly the camera."
)


class CrowdPage:
    """The page; ``step`` moves the crowd and draws it."""

    def __init__(
        self, wandering: Wandering, world: WorldConfig, ground: HeightField, host: str, port: int
    ) -> None:
        self.server, self.url = served_model(host, port)
        self.wandering = wandering
        self._ground = ground = _coarse(ground)
        self._chains = DetailedCrowd(ground, wandering.radius_m, wandering.swims)
        self._wish: Floats = np.zeros(3)
        self._inputs: SimpleQueue[Callable[[], None]] = SimpleQueue()
        scene = self.server.scene
        self.frame = scene.add_frame("/crowd", show_axes=False)
        scene.add_mesh_trimesh("/crowd/ground", ground_mesh(ground))
        draw_water(scene, "/crowd/water", water_surface_m(world, ground))
        self._grid = grid = TubeGrid(*MESHES[MIDDLE - 1])
        numbers = np.arange(len(wandering.species))
        groups = [numbers[:1]]
        groups += [numbers[1:][wandering.species[1:] == k] for k in np.unique(wandering.species)]
        shades = [colours.rgba(colours.HEAD)[:3], *(back[:3] for back, _ in COLOURS)]
        self.drawn: list[tuple[Ints, viser.MeshHandle]] = []
        """Bodies and mesh of each group."""
        tubes = self._tubes()
        for k, group in enumerate(groups):
            if not len(group):
                continue
            faces = grid.faces[None] + grid.corners * np.arange(len(group))[:, None, None]
            mesh = scene.add_mesh_simple(
                f"/crowd/{k}",
                tubes[group].reshape(-1, 3),
                faces.reshape(-1, 3),
                color=shades[k % len(shades)],
                cast_shadow=False,
            )
            self.drawn.append((group, mesh))
        gui = self.server.gui
        self.follow = gui.add_checkbox("follow your animal", False)
        gui.add_markdown(_HINT)
        for key, (label, change) in _KEYS.items():
            gui.add_command(label, hotkey=key).on_trigger(self.steering(change))  # type: ignore[arg-type]
        scene.on_click()(self.on_click)
        middle_m = ground.middle_m
        camera = self.server.initial_camera
        camera.look_at = *middle_m, float(ground.elevation_m(*middle_m))
        camera.position = *(middle_m - [0.35 * ground.size_m[0], 0.0]), 0.25 * ground.size_m[0]

    def step(self, frames: int) -> None:
        """Move the crowd by frames of the repertoire, and draw it."""
        while not self._inputs.empty():  # of the threads of browsers
            self._inputs.get()()
        self.wandering.step(frames)
        place_m = self.wandering.crowd.origin_m[0]
        tubes = self._tubes().astype(np.float32)
        with self.server.atomic():
            self.frame.position = (
                (-place_m[0], -place_m[1], 0.0) if self.follow.value else (0.0, 0.0, 0.0)
            )
            for group, mesh in self.drawn:
                mesh.vertices = tubes[group].reshape(-1, 3)

    def _tubes(self) -> Floats:
        """(N, corners, 3) of all bodies."""
        crowd = self.wandering.crowd
        chains = self._chains.chains(crowd, np.full(len(crowd.scale), MIDDLE))
        points_m = np.array([chain.points_m for chain in chains])
        return self._grid.tubes(points_m, np.array([chain.radius_m for chain in chains]))[0]

    def steering(self, change: tuple[int, int, int]) -> Callable[[object], None]:
        """Return the callback of a key."""
        fastest_m_s = float(self.wandering.fastest_m_s[0])

        def steer() -> None:
            most = np.array([1.0, 3.0 * _TURN, 3.0 * _CLIMB])
            wish = self._wish + np.array(change) * [_FASTER, _TURN, _CLIMB]
            self._wish = np.clip(wish, -most, most)
            share, turn_rad_s, climb_rad = self._wish.tolist()
            self.wandering.pilot(share * fastest_m_s, turn_rad_s, climb_rad)

        return lambda event: self._inputs.put(steer)

    def on_click(self, event: viser.SceneClickEvent) -> None:
        """Send the animal to a point of the ground."""
        at_m = np.asarray(event.ray_origin) - self.frame.position
        point_m = ground_hit_m(self._ground, at_m, event.ray_direction)
        if point_m is not None:
            self._inputs.put(lambda: self._send(point_m))

    def _send(self, point_m: tuple[float, float]) -> None:
        self._wish = np.zeros(3)
        self.wandering.send(np.array([*point_m, self.wandering.crowd.origin_m[0, 2]]))


def serve_crowd(
    wandering: Wandering,
    world: WorldConfig,
    ground: HeightField,
    frame_s: float,
    view_at: str,
) -> None:
    """Serve a crowd in real time until an interrupt."""
    page = CrowdPage(wandering, world, ground, *host_and_port(view_at))
    print(f"{page.url}  (^C ends)", flush=True)
    clock = WallClock()
    due_s = clock.now_s()
    while True:
        due_s = max(due_s + FRAMES * frame_s, clock.now_s() - _LATE_S)
        clock.sleep_until_s(due_s)
        page.step(FRAMES)


def _coarse(ground: HeightField) -> HeightField:
    """Return the ground with about ``_SAMPLES`` samples."""
    step = max(1, round((ground.z_m.size / _SAMPLES) ** 0.5))
    z_m = ground.z_m[::step, ::step]
    return HeightField(z_m, step * ground.spacing_m, ground.x0_m, ground.y0_m)
