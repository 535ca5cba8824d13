"""Joint angles of another program's file as a recording; the readers are plug-ins."""

from pathlib import Path

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.playback import PlaybackConfig
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.console.plugins import plugins
from snakewalk.controller.motion.joint_motion import JointReader, JointRequest, onto_robot

_HEAD_BYTES = 4096


def foreign_joints(
    track: str, robot: RobotConfig, asked: PlaybackConfig
) -> tuple[Floats, Floats, tuple[str, ...]] | None:
    """Times (T,), joint angles (T, J) and lines about the mapping; None for midlines.

    Raises:
        InputError: a fault of the file, or it needs a choice.

    """
    path = Path(track)
    reader = _reader(path)
    chosen = {"joints": asked.joints, "unit": asked.unit, "topic": asked.topic}
    given = [
        name
        for name, value in {**chosen, "episode": asked.episode}.items()
        if value not in (None, {})
    ]
    if reader is None:
        if given:
            option = "--joint" if given[0] == "joints" else f"--{given[0]}"
            raise InputError(f"{option}: {track} has no joint angles with names; leave it out")
        return None
    motion = reader.read(path, JointRequest(asked.unit, asked.topic, asked.episode))
    angles, lines = onto_robot(motion, robot, asked.joints, track)
    return motion.time_s, angles, lines


def _reader(path: Path) -> JointReader | None:
    if not path.exists():
        return None
    head = b""
    if path.is_file():
        try:
            with path.open("rb") as stream:
                head = stream.read(_HEAD_BYTES)
        except OSError as error:
            raise InputError(f"{path}: {error.strerror or error}") from None
    for plugin in plugins("joints"):
        reader: JointReader = plugin.load()()
        if reader.accepts(path, head):
            return reader
    return None
