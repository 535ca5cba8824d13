"""Writes the log row by row: a kill costs half a second at most, a disk fault stops the run."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from importlib.metadata import version
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Literal, Self

import numpy as np
from mcap.writer import Writer
from numpy.typing import ArrayLike

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.heightfield import HeightField
from snakewalk.config.loader import digest
from snakewalk.config.plain_text import plain
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import RunConfig
from snakewalk.config.world import FrictionConfig, WorldConfig
from snakewalk.controller.runlog.encode import (
    encode,
    exact,
    exact_text,
    flags_text,
    floats,
    number,
    rounded_text,
    rounded_texts,
    text,
    thinned,
)
from snakewalk.controller.runlog.record import (
    InitialPose,
    MotorEnergy,
    PlanSummary,
    Winding,
)
from snakewalk.controller.runlog.schema import FORMAT, TOPICS, schema_json, schema_name
from snakewalk.drivers.types import ImuState, JointState

Level = Literal["info", "warning", "error"]
VerdictKind = Literal["pass", "clamp", "veto"]
_FLUSH_S: Final = 0.5
_CHUNK_BYTES: Final = 1 << 20
UNKNOWN_ENERGY: Final = MotorEnergy()


class RunLog:
    """One run's log; a context manager. Writes ``<path>.part``, renamed to ``path`` on leaving.

    Times must not be negative. Any method raises OSError when the disk does not take the bytes.
    ``on_row`` gets the topic and the JSON of every row as well.
    """

    def __init__(self, path: Path, on_row: Callable[[str, bytes], None] | None = None) -> None:
        self.path = path
        self._on_row = on_row
        path.parent.mkdir(parents=True, exist_ok=True)
        self._part = part_path(path)
        self._file = self._part.open("wb")
        self._writer: Any = Writer(  # half untyped
            self._file, chunk_size=_CHUNK_BYTES, enable_data_crcs=True
        )
        self._writer.start(profile="", library=f"snakewalk {version('snakewalk')}")
        self._channels: dict[str, int] = {}
        for topic in TOPICS:
            schema = self._writer.register_schema(
                schema_name(topic), "jsonschema", schema_json(topic)
            )
            self._channels[topic] = self._writer.register_channel(topic, "json", schema)
        self._flushed_s = 0.0
        self._slow = b""
        self._has_cycles = False

    def __enter__(self) -> Self:
        """Start at once."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Finish the file also when the run ends with an error: the log says how it came to it.

        Nothing is left of a run that was refused before its first cycle. A log that the disk does
        not take stays what it is, ``.part``, and the error says its name.
        """
        try:
            try:
                self._writer.finish()
            finally:
                self._file.close()
        except OSError as fault:
            told = error if isinstance(error, OSError) else fault
            told.filename = told.filename or str(self._part)
            told.add_note(f"the run up to there: snakewalk report {self._part}")
            if error is None:
                raise
            return
        if isinstance(error, InputError) and not self._has_cycles:
            self._part.unlink()
        else:
            self._part.replace(self.path)

    def config(
        self,
        run: RunConfig,
        robot: RobotConfig,
        world: WorldConfig,
        *,
        backend: str,
        plan: PlanSummary,
        ground: HeightField | None = None,
        torque_constant_n_m_a: float = float("nan"),
        winding: Winding | None = None,
        initial_pose: InitialPose | None = None,
    ) -> None:
        """Log once, first, what runs; the ground is thinned: enough for a report to draw it."""
        row = {
            "format": FORMAT,
            "software": version("snakewalk"),
            "backend": backend,
            "config_hash": digest(run, robot, world),
            "seed": run.seed,
            "run": run.model_dump(mode="json"),
            "robot": robot.model_dump(mode="json"),
            "world": world.model_dump(mode="json"),
            "torque_constant_n_m_a": number(torque_constant_n_m_a),
            "winding": None if winding is None else asdict(winding),
            "laid": None
            if initial_pose is None
            else {
                "heading_rad": float(initial_pose.heading_rad),
                "joint_rad": exact(initial_pose.joint_rad),
            },
            "plan": {
                "path_m": floats(plan.path_m),
                "waypoints_m": floats(plan.waypoints_m),
                "waypoint_radius_m": number(plan.waypoint_radius_m),
                "predicted_speed_m_s": number(plan.predicted_speed_m_s),
                "states": dict(plan.states or {}),
            },
            "ground": None if ground is None else thinned(ground),
        }
        self._add("/config", 0.0, row)
        self._writer.flush()

    def cycle(
        self,
        time_s: float,
        asked_rad: ArrayLike,
        sent_rad: ArrayLike,
        state: JointState,
        *,
        deadline_s: float,
        lateness_s: float,
        wire_busy_s: float = float("nan"),
        energy: MotorEnergy = UNKNOWN_ENERGY,
        yield_rad: Floats | None = None,
        verdict: VerdictKind = "pass",
        reason: str = "",
        joints: Sequence[int] = (),
    ) -> None:
        """One control cycle; ``/slow`` too when heat, voltage or alarms changed, and ``/imu``."""
        asked, sent = np.asarray(asked_rad, dtype=float), np.asarray(sent_rad, dtype=float)
        asked_text = exact_text(asked)
        same = sent.tobytes() == asked.tobytes()
        position, velocity, current, age = rounded_texts(
            (state.position_rad, state.velocity_rad_s, state.current_a, state.age_s)
        )
        row = (
            f'{{"time_s":{text(time_s)},"asked_rad":{asked_text},'
            f'"sent_rad":{asked_text if same else exact_text(sent)},'
            f'"yield_rad":{"null" if yield_rad is None else rounded_texts([yield_rad])[0]},'
            f'"measured_rad":{position},"velocity_rad_s":{velocity},"current_a":{current},'
            f'"age_s":{age},"valid":{flags_text(state.valid.tobytes(), state.valid.dtype.char)},'
            f'"error":{flags_text(state.error.tobytes(), state.error.dtype.char)},'
            f'"deadline_s":{text(deadline_s)},'
            f'"lateness_s":{rounded_text(lateness_s)},"wire_busy_s":{rounded_text(wire_busy_s)},'
            f'"electrical_j":{rounded_text(energy.electrical_j)},'
            f'"mechanical_j":{rounded_text(energy.mechanical_j)},'
            f'"verdict":"{verdict}","reason":{encode(reason)},'
            f'"joints":{encode([int(j) for j in joints])}}}'
        )
        self._has_cycles = True
        self._add_text("/cycle", time_s, row)
        self._slow_row(time_s, state)
        if state.imu is not None:
            self._imu_row(time_s, state.imu)

    def pose(
        self,
        time_s: float,
        head_m: ArrayLike,
        rotation: ArrayLike,
        *,
        links_m: ArrayLike | None = None,
        centre_m: ArrayLike,
        speed_m_s: float = float("nan"),
        predicted_speed_m_s: float = float("nan"),
        pulse_m_s: float = float("nan"),
        path_s_m: float = float("nan"),
        target: int = 0,
    ) -> None:
        """Where the body is: head (3,), rotation (3, 3), links (L, 3), centre of mass (3,)."""
        given = (head_m, np.ravel(rotation), centre_m, *(() if links_m is None else (links_m,)))
        head, turn, centre, *links = rounded_texts([np.asarray(a, dtype=float) for a in given])
        row = (
            f'{{"time_s":{text(time_s)},"head_m":{head},"rotation":{turn},'
            f'"links_m":{links[0] if links else "null"},"centre_m":{centre},'
            f'"speed_m_s":{rounded_text(speed_m_s)},'
            f'"predicted_speed_m_s":{rounded_text(predicted_speed_m_s)},'
            f'"pulse_m_s":{rounded_text(pulse_m_s)},"path_s_m":{rounded_text(path_s_m)},'
            f'"target":{int(target)}}}'
        )
        self._add_text("/pose", time_s, row)

    def shadow(self, time_s: float, position_rad: Floats, current_a: Floats) -> None:
        """What a simulated chain answers to the goals of the same cycle; (J,) each."""
        position, current = rounded_texts((position_rad, current_a))
        row = f'{{"time_s":{text(time_s)},"position_rad":{position},"current_a":{current}}}'
        self._add_text("/shadow", time_s, row)

    def path_replanned(self, time_s: float, points_m: ArrayLike) -> None:
        """Log a path (n, 2) or (n, 3) that replaces the plan's."""
        self._add("/path", time_s, {"time_s": time_s, "points_m": floats(points_m)})

    def waypoints_changed(self, time_s: float, waypoints_m: ArrayLike) -> None:
        """Log waypoints (w, 2), those reached first, that replace those in force."""
        row = {"time_s": time_s, "waypoints_m": floats(waypoints_m)}
        self._add("/waypoints", time_s, row)

    def walk(
        self,
        time_s: float,
        *,
        state: int,
        visited: int,
        heading_error_rad: float,
        ramp_rad: float,
        candidates: int,
        eta_q: float = float("nan"),
    ) -> None:
        """One decision of the walk."""
        row = {
            "time_s": time_s,
            "state": int(state),
            "visited": int(visited),
            "heading_error_rad": number(heading_error_rad),
            "ramp_rad": number(ramp_rad),
            "candidates": int(candidates),
            "eta_q": number(eta_q),
        }
        self._add("/walk", time_s, row)

    def friction(
        self,
        time_s: float,
        friction: FrictionConfig,
        along_95: tuple[float, float],
        across_95: tuple[float, float],
    ) -> None:
        """Friction that was found under the body, and its intervals of 95 %."""
        row = {
            "time_s": time_s,
            "along": number(friction.along),
            "across": number(friction.across),
            "along_95": floats(along_95),
            "across_95": floats(across_95),
        }
        self._add("/friction", time_s, row)

    def event(self, time_s: float, kind: str, text: str, level: Level = "info") -> None:
        """Log something that happened; above ``info`` it is on the disk when this returns."""
        text = plain(text)
        self._add("/event", time_s, {"time_s": time_s, "level": level, "kind": kind, "text": text})
        if level != "info":
            self._writer.flush()

    def qpos(self, time_s: float, qpos: ArrayLike) -> None:
        """Generalised position (nq,) of the simulation, for film and replay."""
        self._add("/qpos", time_s, {"time_s": time_s, "qpos": floats(qpos)})

    def _slow_row(self, time_s: float, state: JointState) -> None:
        now = (
            state.temperature_c.tobytes()
            + state.voltage_v.tobytes()
            + state.hardware_error.tobytes()
        )
        if now == self._slow:
            return
        self._slow = now
        row = {
            "time_s": time_s,
            "temperature_c": floats(state.temperature_c),
            "voltage_v": floats(state.voltage_v),
            "hardware_error": state.hardware_error.tolist(),
        }
        self._add("/slow", time_s, row)

    def _imu_row(self, time_s: float, imu: ImuState) -> None:
        turn, rate = rounded_texts((imu.rotation.ravel(), imu.rate_rad_s))
        row = (
            f'{{"time_s":{text(time_s)},"rotation":{turn},"rate_rad_s":{rate},'
            f'"age_s":{rounded_text(imu.age_s)}}}'
        )
        self._add_text("/imu", time_s, row)

    def _add(self, topic: str, time_s: float, row: Mapping[str, Any]) -> None:
        self._add_text(topic, time_s, encode(row))

    def _add_text(self, topic: str, time_s: float, row: str) -> None:
        stamp_ns, data = round(time_s * 1e9), row.encode()
        self._writer.add_message(self._channels[topic], stamp_ns, data, publish_time=stamp_ns)
        if self._on_row is not None:
            self._on_row(topic, data)
        if time_s - self._flushed_s >= _FLUSH_S:
            self._flushed_s = time_s
            self._writer.flush()


def part_path(path: Path) -> Path:
    """Where a log is while it is being written, and stays when the run is killed."""
    return path.with_name(path.name + ".part")
