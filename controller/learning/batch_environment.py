"""A Gymnasium vector environment whose robots MuJoCo-Warp advances together."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from typing import Any, ClassVar

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from snakewalk.config.arrays import Bools, Floats, Singles
from snakewalk.config.errors import InputError
from snakewalk.config.extras import require_extra
from snakewalk.controller.learning.environment import SimulatedRobot, SnakeEnvironment
from snakewalk.controller.run.external.gait_batch import MakeBodies
from snakewalk.controller.run.external.robot_batch import BatchRow, RobotBatch, batch_fault
from snakewalk.controller.runlog.record import InitialPose, MotorEnergy
from snakewalk.drivers.types import BodyPose

Actions = NDArray[np.floating[Any]]


class SnakeBatchEnvironment(VectorEnv[Singles, Singles, Any]):  # type: ignore[misc]
    """W snakes on a level floor; action, observation and reward are ``SnakeEnvironment``'s.

    It has no bus: goals reach the servos at once. A robot whose episode has ended starts again in
    the next step, which returns its first observation and reward 0 (``AutoresetMode.NEXT_STEP``).

    Args:
        num_envs: number of robots W.
        max_episode_steps: an episode is truncated after this number of steps.
        device: name of a Warp device; None: the first GPU, or the CPU without one.
        make_bodies: makes the bodies in place of MuJoCo-Warp.
        options: of ``SnakeEnvironment``, without ``render_mode``.

    Raises:
        InputError: a package is missing, or robot or world are not supported.

    """

    metadata: ClassVar[dict[str, Any]] = {"autoreset_mode": AutoresetMode.NEXT_STEP}

    def __init__(
        self,
        num_envs: int = 1,
        *,
        max_episode_steps: int = 500,
        device: str | None = None,
        make_bodies: MakeBodies | None = None,
        **options: Any,
    ) -> None:
        self._rows = [_RowEnvironment(row, **options) for row in range(num_envs)]
        first = self._rows[0].prepared
        fault = batch_fault(first.run, first.robot, first.world)
        if fault is not None:
            raise InputError(f"SnakeBatch: {fault}; use snakewalk/Snake-v0")
        if make_bodies is None:
            make_bodies = _warp_bodies(device)
        bodies = make_bodies(first.robot, first.world, num_envs, first.run.physics_step_s)
        self._batch = RobotBatch(first.run, bodies)
        for row in self._rows:
            row.batch = self._batch
        self.num_envs = num_envs
        self.single_observation_space = self._rows[0].observation_space
        self.single_action_space = self._rows[0].action_space
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._most_steps = max_episode_steps
        self._period_s = self._rows[0].period_s
        self._steps, self._ended = np.zeros(num_envs, int), np.zeros(num_envs, bool)
        self._begin_s = 0.0
        self._cycles = 0

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Singles, dict[str, Any]]:
        """Put new robots on the floor; row k has the seed ``seed + k``."""
        count = self.num_envs
        seeds = (
            [None if seed is None else seed + k for k in range(count)]
            if not isinstance(seed, list)
            else seed
        )
        self._begin_s = self._batch.time_s
        self._cycles = 0
        self._steps[:], self._ended[:] = 0, False
        first_states = [
            row.reset(seed=row_seed, options=options)
            for row, row_seed in zip(self._rows, seeds, strict=True)
        ]
        return np.stack([observation for observation, _ in first_states]), self._infos(
            [info for _, info in first_states]
        )

    def step(
        self, actions: Actions
    ) -> tuple[
        Singles,
        Floats,
        Bools,
        Bools,
        dict[str, Any],
    ]:
        """Send the goals (W, J), advance all robots by a cycle, and read them."""
        begins = self._ended.copy()
        for row, action, new in zip(self._rows, actions, begins, strict=True):
            if not new:
                row.send(action)
        self._cycles += 1
        self._batch.advance(self._begin_s + self._cycles * self._period_s)
        observations = []
        infos = []
        rewards = np.zeros(self.num_envs)
        terminated, truncated = np.zeros((2, self.num_envs), bool)
        for k, row in enumerate(self._rows):
            if begins[k]:
                observation, info = row.reset()
                self._steps[k] = 0
            else:
                observation, rewards[k], terminated[k], _, info = row.result()
                self._steps[k] += 1
                truncated[k] = self._steps[k] >= self._most_steps and not terminated[k]
            observations.append(observation)
            infos.append(info)
        self._ended = terminated | truncated
        return np.stack(observations), rewards, terminated, truncated, self._infos(infos)

    def _infos(self, infos: list[dict[str, Any]]) -> dict[str, Any]:
        joined: dict[str, Any] = {}
        for k, info in enumerate(infos):
            joined = self._add_info(joined, info, k)
        return joined


@dataclass(frozen=True, slots=True)
class _RowRobot:
    """A row of a batch as the robot of an environment."""

    chain: BatchRow
    clock: BatchRow
    pose: Callable[[], BodyPose]
    qpos: Callable[[], Floats] | None
    energy: Callable[[], MotorEnergy]


class _RowEnvironment(SnakeEnvironment):
    """One robot of the batch."""

    def __init__(self, row: int, **options: Any) -> None:
        super().__init__(**options)
        self.batch: RobotBatch | None = None
        self._row = row

    @property
    def prepared(self) -> Any:
        return self._prepared

    def _open_robot(self, initial: InitialPose) -> SimulatedRobot:
        assert self.batch is not None
        prepared = self._prepared
        row = self.batch.start(self._row, prepared.robot, prepared.world, initial)
        return _RowRobot(row, row, row.head_pose, None, row.energy)

    def send(self, action: Actions) -> None:
        self._send(action)

    def result(self) -> tuple[Singles, float, bool, bool, dict[str, Any]]:
        """Return what ``step`` returns, once the batch was advanced."""
        return self._result()


def _warp_bodies(device: str | None) -> MakeBodies:
    require_extra("the batch of robots needs", "warp", "mujoco_warp")
    module = import_module("snakewalk.sim.batch.warp_bodies")  # it imports the packages
    return partial(module.WarpBodies, device=device)
