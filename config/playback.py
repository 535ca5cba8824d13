"""Playback of recordings (table ``playback`` of a run)."""

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field

from snakewalk.config.answers import TableAnswers


class JointRequest(TableAnswers):
    """Facts that a file of joint angles may not state, and parts of it to use."""

    joints: dict[str, str] = Field(
        {},
        description="joint of the file that moves a joint of the robot; `rest` keeps it at 0",
    )
    unit: Literal["rad", "deg"] | None = Field(
        None, description="unit of joint angles if the file states none: rad or deg"
    )
    time_unit: Literal["s", "ms", "us", "ns"] | None = Field(
        None, description="unit of times if a table states none: s, ms, us or ns"
    )
    topic: str | None = Field(
        None, description="topic of a bag that has several topics of joint angles"
    )
    mapping: str | None = Field(
        None, description="code of the mapping of joints that you have checked for a port"
    )
    episode: int | None = Field(
        None, ge=0, description="number of the episode of a LeRobot dataset, from 0"
    )


def _number_or_auto(given: object) -> object:
    return None if given == "auto" else given


class PlaybackConfig(JointRequest):
    """A recording in place of a walk; the file is the run's ``track``."""

    speed: Annotated[float | None, BeforeValidator(_number_or_auto)] = Field(
        None,
        gt=0.0,
        le=10.0,
        description="factor on the animal's speed; default: auto, the largest that the joints "
        "allow, at most 1",
    )
    scale: float = Field(
        1.0,
        gt=0.0,
        le=10.0,
        description="factor on the joint angles; below 1 the motion is smaller",
    )
    clip: bool = Field(
        False, description="hold joints at their limits where the recording bends further"
    )

    @property
    def request(self) -> JointRequest:
        """The answers about a file of joint angles alone."""
        return JointRequest(**self.model_dump(include={*JointRequest.model_fields}))
