"""Registers the environment with Gymnasium: import this module, then ``make`` it.

    import gymnasium
    import snakewalk.gym
    env = gymnasium.make("snakewalk/Snake-v0", robot="yaw16")

or ``gymnasium.make("snakewalk.gym:snakewalk/Snake-v0")``. An episode is cut off after 500 steps,
10 s of the robot. What a step, an action, an observation and the reward are:
``snakewalk.controller.learning.environment``.
"""

from gymnasium import register

register(
    id="snakewalk/Snake-v0",
    entry_point="snakewalk.controller.learning.environment:SnakeEnvironment",
    max_episode_steps=500,
)
register(
    id="snakewalk/SnakeWave-v0",
    entry_point="snakewalk.controller.learning.policy_environment:PolicyEnvironment",
    max_episode_steps=500,
)
register(
    id="snakewalk/SnakeBatch-v0",
    vector_entry_point=("snakewalk.controller.learning.batch_environment:SnakeBatchEnvironment"),
    max_episode_steps=500,
)
