"""``snakewalk gait run``: execution of the options."""

import math
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from snakewalk.config.errors import InputError
from snakewalk.controller.console.options import key_values
from snakewalk.controller.console.progress import TimeBar
from snakewalk.controller.console.run_options import RunOptions
from snakewalk.controller.metrics.displacement import gait_displacement
from snakewalk.controller.run.carry_out import carry_out, watched_by
from snakewalk.controller.run.commands.gait_options import parameters
from snakewalk.controller.run.execute import Finished
from snakewalk.controller.run.finish import by_evidence, show_run, summarized
from snakewalk.controller.run.hands import Hands, open_hands
from snakewalk.controller.run.kinds.gait_factory import prepare_gait
from snakewalk.controller.run.kinds.gait_run import GaitRun
from snakewalk.controller.run.run_keys import with_compliance

_LEAST_S = 0.1
"""Shortest motion (ours)."""


@dataclass(frozen=True, kw_only=True, slots=True)
class GaitJob:
    """A gait with the options of the command."""

    name: str
    robot: str | None
    world: str | None
    param: list[str] | None
    keys: list[str] | None
    then: list[str] | None
    by: str
    seconds: float
    look_heading_rad: float | None
    look_at: str | None
    live: bool
    gamepad: Path | None
    compliance: bool | None
    shadow: bool
    seed: int
    options: RunOptions

    def carry_out(self) -> None:
        """Run the gait and show its result.

        Raises:
            InputError: a value is unknown, or two of them contradict each other.
            SystemExit: safety tripped.

        """
        options = self.options
        if self.by not in {"blend", "cpg"}:
            raise InputError(f"--by {self.by}: expected blend or cpg")
        if self.seconds < _LEAST_S:
            raise InputError(f"--seconds {self.seconds:g}: must be at least {_LEAST_S:g}")
        with ExitStack() as stack:
            watchers = stack.enter_context(watched_by(options))
            page = None if watchers is None else watchers.page
            hands = open_hands(stack, self.live, self.gamepad, page)
            prepared = self._prepared(hands)
            run = prepared.run
            if hands is not None:
                hands.policy = run.safety.lost_observer
            finished, folder = carry_out(
                prepared,
                f"gait-{run.name}-{prepared.robot.name}",
                TimeBar(run.name, self.seconds, _names(prepared, hands)),
                options,
                watchers,
                shadow=self.shadow,
                is_operated=hands is not None,
                stop_requested=lambda: None if hands is None else hands.torque_off(),
            )
        facts = _facts(prepared, finished)
        show_run(finished, folder, facts, options.as_json, film=options.film)

    def _prepared(self, hands: Hands | None) -> GaitRun:
        prepared = prepare_gait(
            self.name,
            robot=self.robot,
            world=self.world,
            parameters=parameters(self.param),
            seconds=self.seconds,
            seed=self.seed,
            look_heading_rad=self.look_heading_rad,
            look_at_m=_point(self.look_at),
            make_operator=None if hands is None else hands.operator,
            then=[_change(text) for text in self.then or []],
            by="cpg" if self.by == "cpg" else "blend",
            keys=key_values("--set", self.keys),
        )
        return replace(prepared, run=with_compliance(prepared.run, self.compliance))


def _facts(prepared: GaitRun, finished: Finished) -> dict[str, object]:
    result: dict[str, object] = {
        "gait": prepared.config.name,
        "robot": prepared.robot.name,
        "world": prepared.world.name,
        "duration_s": round(finished.outcome.duration_s, 2),
        "tripped": finished.outcome.tripped,
        "slowed_to": round(finished.outcome.least_rate, 3),
    }
    if prepared.config.then:
        result["then"] = [f"{change.name}@{change.at_s:g}" for change in prepared.config.then]
    if (
        prepared.make_operator is None
        and not prepared.config.then
        and prepared.config.by == "blend"
    ):
        displacement = finished.travel.gait or gait_displacement(finished.record)
        result |= {
            "frequency_hz": round(displacement.frequency_hz, 3),
            "cycles": displacement.cycles,
        }
        moved = {
            "forward_body_lengths_cycle": _digits(displacement.forward_bl),
            "left_body_lengths_cycle": _digits(displacement.left_bl),
            "up_body_lengths_cycle": _digits(displacement.up_bl),
            "turn_rad_cycle": _digits(displacement.turn_rad),
            "speed_m_s": _digits(displacement.speed_m_s),
        }
        result |= by_evidence(finished, moved)
    result |= {
        "electrical_energy_j": finished.summary.electrical_energy_j,
        **summarized(
            finished.summary, "electrical_cost_of_transport", "mechanical_cost_of_transport"
        ),
        "peak_current_a": finished.summary.peak_current_a,
        "peak_temperature_c": finished.summary.peak_temperature_c,
    }
    return result


def _names(prepared: GaitRun, hands: Hands | None) -> Callable[[float], str]:
    name = prepared.run.name
    if hands is not None:
        return lambda gone_s: hands.gait or name
    return lambda gone_s: [
        name,
        *(change.name for change in prepared.config.then if change.at_s <= gone_s),
    ][-1]


def _change(text: str) -> tuple[float, str, dict[str, Any]]:
    what, *values = text.split(",")
    name, at, seconds = what.rpartition("@")
    try:
        at_s = float(seconds)
    except ValueError:
        at = ""
    if not at or not name:
        raise InputError(f"--then {text}: expected NAME@SECONDS[,PARAM=VALUE...]")
    return at_s, name, parameters(values)


def _point(text: str | None) -> tuple[float, float] | None:
    if text is None:
        return None
    try:
        x, y = (float(part) for part in text.split(","))
    except ValueError:
        raise InputError(f"--look-at {text}: expected X,Y in metres") from None
    return x, y


def _digits(value: float) -> float | None:
    return None if math.isnan(value) else round(value, 4)
