"""Schemas of external poses: the tracked body on a robot, and a simulated tracker."""

from typing import Annotated

from pydantic import Field

from snakewalk.config.base import Share, Strict

Metres = Annotated[float, Field(ge=-1000.0, le=1000.0)]
Degrees = Annotated[float, Field(ge=-360.0, le=360.0)]
Metres3 = tuple[Metres, Metres, Metres]
Degrees3 = tuple[Degrees, Degrees, Degrees]


class PoseConfig(Strict):
    """The tracked body of an external pose source (docs/how-to/external-pose.md).

    Angles are roll, pitch and yaw, turned about fixed axes in this order.
    """

    link: int = Field(
        0, ge=0, description="link of the spine that carries the tracked body; 0 is the head"
    )
    offset_m: Metres3 = Field(
        (0.0, 0.0, 0.0),
        description="origin of the tracked body from the link's centre: forward, left, up",
    )
    offset_deg: Degrees3 = Field(
        (0.0, 0.0, 0.0), description="roll, pitch and yaw of the tracked body's axes in the link's"
    )
    world_m: Metres3 = Field(
        (0.0, 0.0, 0.0), description="origin of the source's frame in the world of the run"
    )
    world_deg: Degrees3 = Field(
        (0.0, 0.0, 0.0), description="roll, pitch and yaw of the source's axes in the world"
    )
    world_sd_deg: float = Field(
        10.0,
        gt=0.0,
        le=180.0,
        description="standard deviation of the yaw in `world_deg`",
    )
    scale: float = Field(
        1.0, gt=0.0, le=1000.0, description="factor on the positions of the source, for metres"
    )
    frame: str | None = Field(
        None,
        max_length=100,
        description="frame that each pose must name; default: that of the first pose",
    )
    sender: str | None = Field(
        None,
        max_length=100,
        description="address of the only host whose poses are used; default: the first sender",
    )
    noise_m: float = Field(
        0.01, ge=1e-4, le=1.0, description="standard deviation of a position without a covariance"
    )
    noise_deg: float = Field(
        3.0, ge=0.01, le=60.0, description="standard deviation of an angle without a covariance"
    )
    latency_s: float | None = Field(
        None,
        ge=0.0,
        le=2.0,
        description="delay of all poses that their times do not show; default: estimated from "
        "the joints' motion",
    )
    max_age_s: float = Field(
        0.5,
        ge=0.05,
        le=5.0,
        description="an older pose is bridged by dead reckoning up to this age; then the run holds",
    )
    hold_s: float = Field(
        10.0,
        ge=0.0,
        le=600.0,
        description="time for which a run without a pose holds, torque on, before it fails",
    )
    start_m: float = Field(
        0.25,
        gt=0.0,
        le=10.0,
        description="largest distance of the first pose from the start of the run",
    )
    start_deg: float = Field(
        20.0,
        gt=0.0,
        le=180.0,
        description="largest angle of the body at the first pose from the heading of the start",
    )


class TrackerConfig(Strict):
    """A simulated tracker: `bus serve --pose-out` and `trials rehearse` publish poses by it."""

    rate_hz: float = Field(50.0, ge=1.0, le=1000.0, description="poses a second")
    noise_m: float = Field(0.0, ge=0.0, le=1.0, description="standard deviation of each coordinate")
    noise_deg: float = Field(0.0, ge=0.0, le=90.0, description="standard deviation of each angle")
    correlation_s: float = Field(
        0.0, ge=0.0, le=60.0, description="time over which the noise keeps its value; 0: white"
    )
    delay_s: float = Field(0.0, ge=0.0, le=5.0, description="delay from measurement to arrival")
    jitter_s: float = Field(0.0, ge=0.0, le=5.0, description="largest additional random delay")
    clock_offset_s: float = Field(
        0.0, ge=-1e9, le=1e9, description="offset of the sender's clock from the robot's"
    )
    clock_drift_ppm: float = Field(
        0.0, ge=-1000.0, le=1000.0, description="drift of the sender's clock"
    )
    lost_share: Share = Field(0.0, description="share of the datagrams that are lost, at random")
    dropout_every_s: float = Field(
        0.0, ge=0.0, description="mean time between dropouts; 0: no dropouts"
    )
    dropout_s: float = Field(0.3, ge=0.0, le=600.0, description="length of a dropout")
    swap_every_s: float = Field(
        0.0, ge=0.0, description="mean time between swaps of markers; 0: no swaps"
    )
    swap_s: float = Field(0.2, ge=0.0, le=60.0, description="length of a swap")
    swap_m: float = Field(
        0.3, ge=0.0, le=10.0, description="distance by which swapped markers move the pose"
    )
