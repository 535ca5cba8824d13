"""A snake of simulated servos as a Gymnasium environment: a step is a control cycle.

Between action and physics everything equals a run: safety link, packets, simulated servos and line.
A policy thus meets clamps, wire time, quantised readings and servo lag.
"""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, Protocol

import gymnasium
import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray

from snakewalk.config.arrays import Floats, Image, Singles
from snakewalk.config.errors import InputError
from snakewalk.config.extras import require_extra
from snakewalk.config.loader import checked, load_robot, load_world
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import RunConfig
from snakewalk.controller.kinematics.links import BodyView, body_in_world
from snakewalk.controller.run.external.served_robot import simulated_views
from snakewalk.controller.run.external.simulated_backend import simulated
from snakewalk.controller.run.prepared_run import PathlessRun, pose_with
from snakewalk.controller.runlog.record import InitialPose, MotorEnergy
from snakewalk.drivers.clock import Clock, WallClock
from snakewalk.drivers.compiling import compiled, readonly_array
from snakewalk.drivers.errors import SafetyTrippedError
from snakewalk.drivers.link import JointLink
from snakewalk.drivers.safety.limits import SafetyLimits
from snakewalk.drivers.safety.safe_link import SafeLink
from snakewalk.drivers.types import BodyPose, JointCommand, JointState

if TYPE_CHECKING:
    from snakewalk.sim.rendering.chase_view import ChaseView, ChaseWindow

_FLOATS = readonly_array()
_LARGEST_SPEED_RAD_S = 20.0
_LARGEST_SPEED_M_S = 3.0
_CURRENT_A = 10.0
"""Ends of the observation space (ours): far beyond what a body of such servos does."""


class SimulatedRobot(Protocol):
    """Servos and body of an episode; a ``Backend`` is one."""

    @property
    def chain(self) -> JointLink:
        """The joints."""
        ...

    @property
    def clock(self) -> Clock:
        """Time of the robot."""
        ...

    @property
    def pose(self) -> Callable[[], BodyPose] | None:
        """Return the true pose of the head."""
        ...

    @property
    def qpos(self) -> Callable[[], Floats] | None:
        """Return the simulator's coordinates."""
        ...

    @property
    def energy(self) -> Callable[[], MotorEnergy]:
        """Return the energy of the motors so far."""
        ...


METADATA: dict[str, Any] = {"render_modes": ["human", "rgb_array"], "render_fps": 50}


class SnakeEnvironment(gymnasium.Env[Singles, Singles]):
    """A chain of servos on its ground that is to go along x, as far as it can for its energy.

    With J joints, head first; ``observation_names`` has a name with its unit for each number.

    Action (J,): goal angles as shares of the joints' limits, -1 to 1: the goals in rad are
    ``action * limit_rad``. The safety link clamps their rate.

    Observation (4 J + 7,): measured angles (rad), velocities (rad/s) and currents (A), as in the
    packets; the last goals that safety passed (rad). The simulation adds the world's up in the axes
    of the head, and cosine and sine of the body's mean heading (x being 0). It also adds the
    velocity of the centre of mass along x and y since the last step (m/s).

    Reward, in m: how far the centre of mass came along x, less ``energy_weight_m_j`` metres for
    each joule that the motors took in. If safety trips, the episode terminates, and
    ``trip_penalty_m`` is taken off; ``info["tripped"]`` says why. Otherwise it ends by the time
    limit of ``make``.

    ``info`` has ``x_m`` and ``y_m`` of the centre of mass, ``energy_j`` since the start,
    ``clamped`` (joints whose goal safety moved in this step), and ``tripped``.

    Args:
        robot: shipped robot, or a TOML file.
        world: shipped world, or a TOML file.
        cycle_hz: control cycles, and steps, a second of the robot.
        physics_step_s: 5 ms is good enough on a floor (``docs/physics.md``), and quick.
        energy_weight_m_j: metres that a joule is worth.
        trip_penalty_m: metres that a trip costs.
        start_joint_rad: joints start within this, drawn evenly.
        start_heading_rad: so does the heading, around x.
        render_mode: ``rgb_array``: ``render`` returns a picture (480, 640, 3); ``human``: a window
            follows the body in real time; None: nothing is drawn.

    Raises:
        InputError: a file is wrong, MuJoCo is not installed, or the mode is unknown.

    """

    metadata: dict[str, Any] = METADATA

    def __init__(
        self,
        robot: str = "yaw16",
        world: str = "flat",
        *,
        cycle_hz: float = 50.0,
        physics_step_s: float = 0.005,
        energy_weight_m_j: float = 0.0005,
        trip_penalty_m: float = 1.0,
        start_joint_rad: float = 0.1,
        start_heading_rad: float = 0.2,
        render_mode: str | None = None,
    ) -> None:
        require_extra("the environment needs", "mujoco")
        modes = METADATA["render_modes"]
        if render_mode is not None and render_mode not in modes:
            raise InputError(f"render_mode '{render_mode}': expected {', '.join(modes)}, or None")
        self.render_mode = render_mode
        body = load_robot(robot)
        fields = {
            "name": "snake-environment",
            "robot": body.name,
            "world": world,
            "motion": "source",
            "cycle_hz": cycle_hz,
            "physics_step_s": physics_step_s,
        }
        run = checked(RunConfig, fields, "SnakeEnvironment")
        self._prepared = PathlessRun(run, body, load_world(world))
        self._energy_weight_m_j = energy_weight_m_j
        self._trip_penalty_m = trip_penalty_m
        self._spread_rad = (start_joint_rad, start_heading_rad)
        if min(self._spread_rad) < 0.0 or start_joint_rad > min(body.limit_rad):
            raise InputError(
                f"start_joint_rad = {start_joint_rad:g}, start_heading_rad = "
                f"{start_heading_rad:g}: expected 0 to {min(body.limit_rad):g}, and at least 0"
            )
        self.limit_rad: Floats = np.array(body.limit_rad)
        """(J,) angle of an action of 1."""
        self.action_space = spaces.Box(-1.0, 1.0, (body.joint_count,), dtype=np.float32)
        ends = np.repeat([np.pi, _LARGEST_SPEED_RAD_S, _CURRENT_A], body.joint_count)
        self._end = np.concatenate(
            [ends, self.limit_rad, np.ones(5), np.full(2, _LARGEST_SPEED_M_S)]
        ).astype("f4")
        self.observation_space = spaces.Box(-self._end, self._end, dtype=np.float32)
        self.observation_names = _names(body)
        """Name of each number of an observation, with its unit."""
        self._limits = SafetyLimits.from_config(body, run.safety)
        self._backend: SimulatedRobot | None = None
        self._link: SafeLink | None = None
        self._due_s = 0.0
        self._taken_j = 0.0
        self._view: BodyView | None = None
        self._sent_rad: Floats = np.zeros(body.joint_count)
        self._screen: ChaseView | ChaseWindow | None = None
        self._clock = WallClock()
        self._shown_s = 0.0

    @property
    def robot(self) -> RobotConfig:
        """The body and its servos."""
        return self._prepared.robot

    @property
    def period_s(self) -> float:
        """Duration of a step in the robot's time."""
        return 1.0 / self._prepared.run.cycle_hz

    @property
    def view(self) -> BodyView:
        """The last measured state of the body.

        Raises:
            gymnasium.error.ResetNeeded: no episode has begun.

        """
        if self._view is None:
            raise gymnasium.error.ResetNeeded("call reset before reading the body")
        return self._view

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Singles, dict[str, Any]]:
        """Lay another robot of the same kind on the ground, torque on; needs as long as 600 steps.

        Raises:
            InputError: ``options`` are given, although none exist.

        """
        super().reset(seed=seed)
        if options:
            raise InputError(f"reset knows no options, but got {', '.join(options)}")
        joints, heading = self._spread_rad
        robot = self._prepared.robot
        start_rad = self.np_random.uniform(-joints, joints, robot.joint_count)
        initial = pose_with(robot, float(self.np_random.uniform(-heading, heading)), start_rad)
        backend = self._open_robot(initial)
        link = SafeLink(backend.chain, self._limits, backend.clock)
        state = link.enable()
        self._backend = backend
        self._link = link
        self._due_s, self._taken_j = backend.clock.now_s(), backend.energy().electrical_j
        self._sent_rad = state.position_rad
        self._view = None
        observation, _ = self._observe(backend, state)
        self._show()
        return observation, self._info(link)

    def step(
        self, action: NDArray[np.floating[Any]]
    ) -> tuple[Singles, float, bool, bool, dict[str, Any]]:
        """Send goals (J,), as shares of the limits; wait for the next cycle, read all servos.

        Raises:
            gymnasium.error.ResetNeeded: no episode is running, or safety has tripped in it.
            gymnasium.error.InvalidAction: its shape is not that of ``action_space``.

        """
        self._send(action)
        assert self._backend is not None
        self._backend.clock.sleep_until_s(self._due_s)
        return self._result()

    def _open_robot(self, initial: InitialPose) -> SimulatedRobot:
        prepared = self._prepared
        return simulated(prepared.run, prepared.robot, prepared.world, prepared.ground, initial)

    def _send(self, action: NDArray[np.floating[Any]]) -> None:
        """Send the goals of a step; ``_result`` needs the time at its end."""
        backend = self._backend
        link = self._link
        if backend is None or link is None or link.tripped:
            raise gymnasium.error.ResetNeeded("call reset before step")
        goal_rad = checked_action(action, self.robot.joint_names) * self.limit_rad
        self._due_s += self.period_s
        try:
            link.write(JointCommand(backend.clock.now_s(), goal_rad))
        except SafetyTrippedError:
            pass  # it has latched: the episode ends, with the last readings
        else:
            if link.last_verdict is not None:
                self._sent_rad = link.last_verdict.goal_rad

    def _result(self) -> tuple[Singles, float, bool, bool, dict[str, Any]]:
        """Read all servos at the end of a step, and return what ``step`` returns."""
        backend = self._backend
        link = self._link
        assert backend is not None
        assert link is not None
        observation, progress_m = self._observe(backend, link.read())
        taken_j = backend.energy().electrical_j
        reward = progress_m - self._energy_weight_m_j * (taken_j - self._taken_j)
        self._taken_j = taken_j
        info = self._info(link)
        tripped = info["tripped"] is not None
        if tripped:
            reward -= self._trip_penalty_m
        self._show()
        return observation, reward, tripped, False, info

    def render(self) -> Image | None:
        """Return a picture of the body, (480, 640, 3), if the mode is ``rgb_array``; else None.

        Raises:
            gymnasium.error.ResetNeeded: no episode has begun.
            InputError: nothing here can draw.

        """
        if self._backend is None or self._backend.qpos is None:
            raise gymnasium.error.ResetNeeded("call reset before render")
        if self.render_mode is None:
            return None
        prepared = self._prepared
        if self._screen is None:
            views = simulated_views()
            kind = views.ChaseWindow if self.render_mode == "human" else views.ChaseView
            self._screen = kind(prepared.robot, prepared.world, prepared.ground)
        return self._screen.draw(self._backend.qpos())

    def close(self) -> None:
        """Close window and frame buffer; safe to call twice."""
        if self._screen is not None:
            self._screen.close()
        self._screen = None

    def _show(self) -> None:
        """Follow the body in the window, in real time."""
        if self.render_mode != "human":
            return
        self._clock.sleep_until_s(self._shown_s + self.period_s)
        self._shown_s = self._clock.now_s()
        self.render()

    def _observe(self, backend: SimulatedRobot, state: JointState) -> tuple[Singles, float]:
        """Observation, and how far the centre of mass came along x since the one before."""
        assert backend.pose is not None  # a simulated one
        pose = backend.pose()
        view = body_in_world(self._prepared.robot, pose, state.position_rad)
        moved_m = np.zeros(2) if self._view is None else (view.centre_m - self._view.centre_m)[:2]
        self._view = view
        values = np.empty_like(self._end)
        _fill(
            values,
            self._end,
            state.position_rad,
            state.velocity_rad_s,
            state.current_a,
            self._sent_rad,
            view.rotation,
            moved_m * self._prepared.run.cycle_hz,
        )
        return values, float(moved_m[0])

    def _info(self, link: SafeLink) -> dict[str, Any]:
        assert self._view is not None
        verdict = link.last_verdict
        return {
            "x_m": float(self._view.centre_m[0]),
            "y_m": float(self._view.centre_m[1]),
            "energy_j": self._taken_j,
            "clamped": [] if verdict is None else verdict.clamped.nonzero()[0].tolist(),
            "tripped": link.tripped,
        }


def checked_action(action: NDArray[np.floating[Any]], names: Sequence[str]) -> Floats:
    """Return an action as floats.

    Args:
        action: of a policy.
        names: of its numbers.

    Raises:
        gymnasium.error.InvalidAction: it has another shape.

    """
    values = np.asarray(action, dtype=float)
    if values.shape != (len(names),):
        raise gymnasium.error.InvalidAction(
            f"action: has shape {values.shape}, expected ({len(names)},): one number for each of "
            f"{', '.join(names)}"
        )
    return values


@compiled(
    f"void(float32[::1], float32[::1], {_FLOATS}, {_FLOATS}, {_FLOATS}, {_FLOATS},"
    " float64[:, :, ::1], float64[::1])"
)
def _fill(
    values: Singles,
    end: Singles,
    position_rad: Floats,
    velocity_rad_s: Floats,
    current_a: Floats,
    sent_rad: Floats,
    rotation: Floats,
    velocity_m_s: Floats,
) -> None:
    """Fill an observation (4 J + 7,), cut at its ends.

    Args:
        values: to be filled.
        end: greatest values.
        position_rad: (J,)
        velocity_rad_s: (J,)
        current_a: (J,)
        sent_rad: (J,)
        rotation: (L, 3, 3) axes of the links as columns; the mean heading is of their directions,
            each followed from the one before without a jump by a turn.
        velocity_m_s: (2,) of the centre of mass.

    """
    joints = len(position_rad)
    for k in range(joints):
        values[k] = position_rad[k]
        values[joints + k] = velocity_rad_s[k]
        values[2 * joints + k] = current_a[k]
        values[3 * joints + k] = sent_rad[k]
    offset = 4 * joints
    for axis in range(3):
        values[offset + axis] = rotation[0, 2, axis]
    before = total = np.arctan2(rotation[0, 1, 0], rotation[0, 0, 0])
    for link in range(1, len(rotation)):
        heading = np.arctan2(rotation[link, 1, 0], rotation[link, 0, 0])
        before = heading - 2.0 * np.pi * np.rint((heading - before) / (2.0 * np.pi))
        total += before
    mean = total / len(rotation)
    values[offset + 3], values[offset + 4] = np.cos(mean), np.sin(mean)
    values[offset + 5], values[offset + 6] = velocity_m_s[0], velocity_m_s[1]
    for k in range(len(values)):
        values[k] = min(max(values[k], -end[k]), end[k])


def _names(robot: RobotConfig) -> tuple[str, ...]:
    kinds = ("measured", "rad"), ("velocity", "rad_s"), ("current", "a"), ("sent", "rad")
    joints = [f"{of}_joint{k}_{unit}" for of, unit in kinds for k in range(robot.joint_count)]
    body = ("up_forward", "up_left", "up_up", "heading_cos", "heading_sin")
    return (*joints, *body, "velocity_x_m_s", "velocity_y_m_s")
