"""Steps that all preparations of runs share."""

from collections.abc import Mapping

from snakewalk.config.loader import checked, load_robot, load_world
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import RunConfig
from snakewalk.config.world import WorldConfig
from snakewalk.controller.run.run_keys import with_keys_of
from snakewalk.controller.run.servo_setup import check_servos


def load_body(name: str, keys: Mapping[str, object]) -> RobotConfig:
    """Load a robot and replace values of its file.

    Args:
        name: a shipped robot, or a file.
        keys: as ``checked_keys`` returns them.

    Raises:
        ConfigError: every fault of the file.
        InputError: a key does not fit.

    """
    return with_keys_of("robot", load_robot(name), keys)


def assemble(
    fields: Mapping[str, object],
    keys: Mapping[str, object],
    body: RobotConfig,
    *,
    origin: str = "command line",
) -> tuple[RunConfig, WorldConfig]:
    """Check a run, apply the keys of run and world, and check its servos and its cycle rate.

    Args:
        fields: of ``RunConfig``.
        keys: as ``checked_keys`` returns them.
        body: the robot that runs.
        origin: name that messages use for the origin of the fields.

    Raises:
        InputError: one line per fault.

    """
    run = with_keys_of("run", checked(RunConfig, dict(fields), origin), keys)
    check_servos(run, body)
    return run, with_keys_of("world", load_world(run.world), keys)
