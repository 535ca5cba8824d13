"""Schema of a fault file: faults of a simulated bus, and their times.

A file has a ``seed`` and ``[[fault]]`` tables. Every fault has a ``kind``, begins ``at_s`` seconds
after the start, and most last ``for_s`` seconds (by default to the end).
"""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from snakewalk.config.base import Strict

ServoId = Annotated[int, Field(ge=0, le=252)]


class _Fault(Strict):
    at_s: float = Field(0.0, ge=0.0, description="time at which the fault begins")


class _Lasting(_Fault):
    for_s: float | None = Field(
        None, gt=0.0, description="duration of the fault; not given: to the end"
    )


class NoiseFault(_Lasting):
    """Packets that a bad cable or a busy host changes; each packet has ``chance``."""

    kind: Literal["drop", "corrupt", "truncate", "duplicate", "delay", "late"] = Field(
        description="change of a packet; late: a reply that the host no longer waits for"
    )
    chance: float = Field(1.0, gt=0.0, le=1.0, description="share of the packets that change")
    ids: tuple[ServoId, ...] = Field((), description="IDs of the affected servos; not given: all")
    of: Literal["answers", "questions", "both"] = Field(
        "answers",
        description="packets that change: those of the servos, those of the host, or both",
    )
    by_s: float | None = Field(
        None, gt=0.0, description="delay of the packets, if change is delay or late"
    )

    @model_validator(mode="after")
    def _fits_its_kind(self) -> Self:
        slow = self.kind in ("delay", "late")
        if slow and self.of != "answers":
            raise ValueError(f"{self.kind}: only replies can be slow; leave 'of' out")
        if not slow and self.by_s is not None:
            raise ValueError(f"{self.kind}: has no 'by_s'")
        if self.ids and self.of != "answers":
            raise ValueError("'ids' selects replies; a request goes to the whole bus")
        return self


class ServoFault(_Lasting):
    """Servos that fail for a while.

    They do not reply, jam, lose their supply, have a dead output stage, ignore sync writes, or set
    the alert bit without an error.
    """

    kind: Literal["mute", "stuck", "brown_out", "no_output", "deaf", "alert"] = Field(
        description="failure: no reply (mute), no motion (stuck), no supply (brown_out), no torque "
        "(no_output), sync writes ignored (deaf), or an alert bit without an error (alert)"
    )
    ids: tuple[ServoId, ...] = Field(min_length=1, description="IDs of the servos that fail")


class ClashFault(_Lasting):
    """One servo changes to the ID of another, which keeps it or gets that of the first."""

    kind: Literal["clash", "exchange"] = Field(
        description="whether the other servo keeps its ID (clash) or gets the first one's"
    )
    id: ServoId = Field(description="ID of the servo that changes")
    takes: ServoId = Field(description="ID that the servo changes to")


class WriteFault(_Lasting):
    """Another program writes to a register of servos, by its name in the control table."""

    kind: Literal["write"]
    ids: tuple[ServoId, ...] = Field(
        min_length=1, description="IDs of the servos that are written to"
    )
    register_name: str = Field(
        min_length=1,
        alias="register",
        description="register that is written to, named as in the control table",
    )
    value: int = Field(description="raw value that is written")
    every_s: float | None = Field(
        None, ge=1e-3, description="time between repeated writes; not given: one write"
    )

    @model_validator(mode="after")
    def _lasts_if_repeated(self) -> Self:
        if self.every_s is None and self.for_s is not None:
            raise ValueError("write: 'for_s' needs 'every_s'; a single write does not end")
        return self


class ReadingFault(_Lasting):
    """A dead sensor: servos report a constant value in a register (``Present Temperature``)."""

    kind: Literal["reading"]
    ids: tuple[ServoId, ...] = Field(
        min_length=1, description="IDs of the servos with the dead sensor"
    )
    register_name: str = Field(
        min_length=1,
        alias="register",
        description="register with the constant value, named as in the control table",
    )
    value: int | None = Field(
        None, description="constant value of the sensor; not given: its value when the fault begins"
    )


class TripFault(_Fault):
    """Servos detect an error (Hardware Error Status(70)), reboot, or get hot."""

    kind: Literal["reboot", "overload", "overheating", "voltage", "encoder", "shock"] = Field(
        description="error that the servos detect, or reboot"
    )
    ids: tuple[ServoId, ...] = Field(
        min_length=1, description="IDs of the servos that detect the error"
    )


class HeatFault(_Fault):
    """The housing of servos has a temperature, from which they cool down or trip."""

    kind: Literal["heat"]
    ids: tuple[ServoId, ...] = Field(min_length=1, description="IDs of the servos that are hot")
    celsius: float = Field(
        ge=-20.0, le=200.0, description="temperature of the housing when the fault begins"
    )


class SupplyFault(_Lasting):
    """The supply of some servos, or of the whole bus, has another voltage."""

    kind: Literal["supply"]
    volts: float = Field(ge=0.0, le=40.0, description="voltage of the supply during the fault")
    ids: tuple[ServoId, ...] = Field((), description="IDs of the affected servos; not given: all")


class UnplugFault(_Lasting):
    """The cable behind one servo is out: all that follow in the chain lose bus and supply."""

    kind: Literal["unplug"]
    behind: ServoId = Field(description="ID of the last servo that is still connected")


class StallFault(_Fault):
    """The host does not run for a while; its packets go out later."""

    kind: Literal["stall"]
    for_s: float = Field(gt=0.0, description="time for which the host does not run")


class PortFault(_Lasting):
    """The port vanishes, as an adapter does that is pulled out, and comes back."""

    kind: Literal["port"]


ScheduledFault = (
    ServoFault
    | ClashFault
    | WriteFault
    | ReadingFault
    | TripFault
    | HeatFault
    | SupplyFault
    | UnplugFault
    | PortFault
)
"""Fault that begins and ends at a time; other faults change packets or stop the host."""
Fault = Annotated[NoiseFault | StallFault | ScheduledFault, Field(discriminator="kind")]


class FaultPlan(Strict):
    """A fault file."""

    seed: int = Field(0, ge=0, description="seed of all random choices")
    fault: tuple[Fault, ...] = Field(
        (), description="faults in the order of the file; each has a start and an end"
    )
