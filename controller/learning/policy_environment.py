"""Environment of a policy's training: a ``PolicyMotion`` on a robot without a camera."""

from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces

from snakewalk.config.arrays import Image, Singles
from snakewalk.controller.learning.environment import METADATA, SnakeEnvironment, checked_action
from snakewalk.controller.motion.policy import (
    WAVE_SPAN,
    Origin,
    Policy,
    PolicyWave,
    observation_names,
)
from snakewalk.controller.motion.policy_motion import PolicyMotion

WAVE_NAMES = tuple(
    f"{key}_{number}" if isinstance(value, tuple) else key
    for key, value in PolicyWave().model_dump().items()
    for number in range(1, np.size(value) + 1)
)
"""Names of an action's P numbers."""
_UNTRAINED_POLICY = Policy(
    name="untrained",
    robot="any",
    origin=Origin(method="none", seed=0, steps=0, world="none", software="none"),
)


class PolicyEnvironment(gymnasium.Env[Singles, Singles]):
    """A snake whose wave an agent changes; reward, end and ``info`` are ``SnakeEnvironment``'s.

    With n yaw joints and P = 16 values of a wave (``PolicyWave``):

    Action (P,): -1 to 1, changes of the wave in ``WAVE_SPAN``, from the wave of ``policy``.

    Observation (2 n + 4,): cosine and sine of the phase and of the body's mean heading, measured
    angles, and the motion's last goals; ``observation_names`` has a name for each.

    Args:
        policy: whose wave an action of zeros runs; its network is left out. By default a lateral
            undulation.
        options: of ``SnakeEnvironment``.

    """

    metadata: dict[str, Any] = METADATA

    def __init__(self, policy: Policy = _UNTRAINED_POLICY, **options: Any) -> None:
        self._snake = SnakeEnvironment(**options)
        self.render_mode = self._snake.render_mode
        self._policy = policy.model_copy(update={"network": (), "observation": ()})
        self._motion: PolicyMotion | None = None
        self.observation_names = observation_names(self._snake.robot)
        """Name of each number of an observation, with its unit."""
        ends = np.full(len(self.observation_names), np.pi, dtype="f4")
        self.observation_space = spaces.Box(-ends, ends, dtype=np.float32)
        self.action_space = spaces.Box(-1.0, 1.0, WAVE_SPAN.shape, dtype=np.float32)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Singles, dict[str, Any]]:
        """Lay another robot on the ground, with a motion at its beginning."""
        super().reset(seed=seed)
        wave_seed = int(self.np_random.integers(2**31)) if seed is None else seed
        _, info = self._snake.reset(seed=wave_seed, options=options)
        self._motion = PolicyMotion(self._policy, self._snake.robot)
        return self._observe(self._motion), info

    def step(self, action: Singles) -> tuple[Singles, float, bool, bool, dict[str, Any]]:
        """Change the wave, go on by a cycle.

        Raises:
            gymnasium.error.ResetNeeded: no episode is running, or safety has tripped in it.
            gymnasium.error.InvalidAction: its shape is not that of ``action_space``.

        """
        if self._motion is None:
            raise gymnasium.error.ResetNeeded("call reset before step")
        goal_rad = self._motion.act(checked_action(action, WAVE_NAMES), self._snake.period_s)
        _, reward, tripped, cut, info = self._snake.step(goal_rad / self._snake.limit_rad)
        return self._observe(self._motion), reward, tripped, cut, info

    def render(self) -> Image | None:
        """As ``SnakeEnvironment.render``."""
        return self._snake.render()

    def close(self) -> None:
        """Close window and frame buffer; safe to call twice."""
        self._snake.close()

    def _observe(self, motion: PolicyMotion) -> Singles:
        return motion.observe(self._snake.view).astype("f4")
