"""Description of a shipped recording: figures of a real animal from which it is generated."""

from pydantic import Field, model_validator

from snakewalk.config.base import Strict


class EpisodeConfig(Strict):
    """A stretch of the motion, as made by the head and passed on to the tail."""

    cycles: float = Field(gt=0.0, le=100.0, description="duration in cycles of the wave")
    gain: float = Field(1.0, gt=0.0, le=3.0, description="factor on the measured bends")
    waves: float | None = Field(
        None, gt=0.1, le=5.0, description="number of waves on the body; default: measured"
    )
    turn_rad: float = Field(0.0, ge=-7.0, le=7.0, description="change of heading, + is left")


class RecordingConfig(Strict):
    """A travelling wave of tangent angle with an envelope, and the episodes it goes through."""

    name: str = Field(description="name of the recording")
    source: str = Field(description="animal, and source of the recording")
    licence: str = Field(description="licence of the recording that was measured")
    rate_hz: float = Field(gt=0.0, description="frames per second")
    length_m: float = Field(gt=0.0, description="length of the animal")
    waves: float = Field(gt=0.1, le=5.0, description="number of waves on the body")
    frequency_hz: float = Field(gt=0.0, description="waves per second")
    travel: float = Field(ge=0.0, le=1.0, description="speed of the head over speed of the wave")
    envelope_rad: tuple[float, ...] = Field(
        min_length=2, description="amplitude of tangent angle at equal stations, head to tail"
    )
    episodes: tuple[EpisodeConfig, ...] = Field(
        min_length=1, description="parts of the recording, one after the other"
    )

    @model_validator(mode="after")
    def _check_length(self) -> "RecordingConfig":
        if self.rate_hz < 4.0 * self.frequency_hz:
            raise ValueError("rate_hz must be at least 4 frames a cycle")
        return self
