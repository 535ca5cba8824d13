"""How a recording is played in time: table ``playback`` of a run; the file is its ``track``."""

from pydantic import Field

from snakewalk.config.base import Strict


class PlaybackConfig(Strict):
    """A recording in place of a walk."""

    speed: float | None = Field(
        None, gt=0.0, le=10.0, description="times the animal's own; default: as fast as joints can"
    )
    scale: float = Field(
        1.0, gt=0.0, le=10.0, description="times the joint angles of the recording: its amplitude"
    )
    clip: bool = Field(
        False, description="joints are held within their limits, where the recording bends further"
    )
