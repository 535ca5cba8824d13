"""A snake's motion without a robot: library, path, walk, speed, skeleton, ground ([PT] 2.6)."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.synthesis import (
    Adaptation,
    Along,
    Curve,
    SynthesisConfig,
    along_body,
    curve_at,
)
from snakewalk.controller.animals.synthesis.film_graph import (
    FilmStates,
    film_angles,
    with_random_states,
)
from snakewalk.controller.animals.synthesis.graph_motion import graph_motion
from snakewalk.controller.animals.synthesis.synthesis import (
    Behaviour,
    Locomotion,
    Sampling,
    Start,
    Targets,
    synthesise,
    varied_pulse,
)
from snakewalk.controller.animals.synthesis.tongue import HeightChain, Tongue, TongueRecord
from snakewalk.controller.mechanics.ground_step import (
    GroundedSkeleton,
    GroundStep,
    half_heights_m,
)
from snakewalk.controller.mechanics.speed_law import SpeedLaw
from snakewalk.controller.run.kinds.walk_run import POINTS, WalkRun
from snakewalk.controller.shape.library import ShapeFilter, StateLibrary, build_library
from snakewalk.controller.shape.states import to_angles, to_states
from snakewalk.controller.terrain.in_steps import at_once
from snakewalk.controller.terrain.path import SplinePath
from snakewalk.controller.track.analysis import analyse
from snakewalk.controller.track.bone_motion import BoneMotion, from_points
from snakewalk.controller.track.readers.load import load_track
from snakewalk.controller.walk.angle_track import AngleTrack

FRAMES_MAX = 300_000
"""Largest number of frames of a motion: 240 s at 1000 Hz are fewer (ours)."""
_ANIMAL = ("turn", "self-contact")
"""Tests of a shape that no robot needs to make."""


@dataclass(frozen=True, slots=True)
class SynthesisedWalk:
    """A motion over a world, and how it came about."""

    plan: Locomotion
    """Motion in the plane: [PT]'s prototype."""
    skeleton: GroundedSkeleton
    """Skeleton on the ground of the world."""
    half_height_m: Floats
    """(N + 1,) radius of the body at the skeleton's points."""
    rate_hz: float
    path: SplinePath
    targets: Targets
    states: list[tuple[int, int]]
    """Frame and state of each decision."""
    library: StateLibrary
    sliding: Floats
    """(T, N) sliding w_d along the body: share of the pulse that is lost."""
    pulse_m_s: Floats
    """(T, N) pulse speed g along the body, m/s."""
    head_held: Floats
    """(T,) share of the body's mean heading in the head and neck, 0 to 1."""
    calm_tail: Floats
    """(T,) share by which the bends of the tail are flattened, 0 to 1."""
    tongue: Floats
    """(T,) position of the tongue: 0 drawn in, 1 out."""
    tongue_evidence: str
    """Evidence of the tongue's motion: measured or assumed, and the source."""

    @property
    def complete(self) -> bool:
        """Whether the last target was reached."""
        return self.targets.index == self.targets.count

    @property
    def time_s(self) -> Floats:
        """(T,) of the frames."""
        return np.arange(len(self.plan.speed_m_s)) / self.rate_hz

    @property
    def length_m(self) -> float:
        """Length of the body."""
        return float(np.hypot(*np.diff(self.plan.points_m[0], axis=0).T).sum())

    def bones(self, segments: int = 1) -> BoneMotion:
        """Bones on the ground, each of ``segments`` segments, a divisor of their number.

        Raises:
            InputError: the motion stands upright somewhere.

        """
        return from_points(self.skeleton.points_m[:, ::segments], self.time_s)

    def reached_s(self) -> list[float]:
        """Time at which each waypoint was reached."""
        current = np.array(self.targets.current)
        ends = np.flatnonzero(self.targets.required) + 1
        reached_frames = [np.flatnonzero(current >= end) for end in ends]
        return [float(self.time_s[frames[0]]) for frames in reached_frames if len(frames)]

    def facts(self) -> dict[str, object]:
        """Plain numbers, for the table and JSON."""
        plan = self.plan
        targets = self.targets
        distinct = {state for _, state in self.states}
        moved_m = np.diff(plan.points_m[:, :-1], axis=0)
        turn = plan.angles_rad[:-1]
        aside_m = np.abs(moved_m[..., 1] * np.cos(turn) - moved_m[..., 0] * np.sin(turn))
        return {
            "frames": len(plan.speed_m_s),
            "seconds": round(float(self.time_s[-1]), 2),
            "waypoints": int(targets.required.sum()),
            "waypoints_reached": int(targets.required[: targets.index].sum()),
            "passed_by": targets.missed,
            "path_m": round(self.path.length_m, 3),
            "states": len(self.library.shapes_rad),
            "states_taken": len(self.states),
            "states_distinct": len(distinct),
            "states_random": len(distinct - set(range(self.library.recorded))),
            "speed_mean_m_s": round(float(plan.speed_m_s.mean()), 4),
            "speed_mean_body_lengths_s": round(float(plan.speed_m_s.mean()) / self.length_m, 4),
            "sideways_share": round(float(aside_m.sum() / np.hypot(*moved_m.T).sum()), 3),
            "bend_k_rad": round(float(np.median(plan.angles_rad.std(axis=1))), 3),
            "steepest_deg": round(float(np.degrees(self.skeleton.steepest_rad)), 1),
            "tongue_learned_from": self.tongue_evidence,
            "segments_stretched_most": round(self._stretch(), 4),
            "ground_gap_most_m": round(float(np.abs(self.skeleton.gap_m).max()), 9),
        }

    def _stretch(self) -> float:
        points = self.skeleton.points_m
        segment_m = self.length_m / (points.shape[-2] - 1)
        return float(np.linalg.norm(np.diff(points, axis=-2), axis=-1).max() / segment_m - 1.0)

    def save(self, file: Path, name: str, source: str) -> None:
        """Write a track that every command for recordings accepts, with additional arrays.

        ``points`` (T, N + 1, 2) are the skeleton in plan and ``height_m`` (T, N + 1) its height.
        ``radius_m`` (N + 1,) is half the body's thickness, ``tongue`` (T,) its tongue, and
        ``state`` (T,) the last state.
        """
        points = self.skeleton.points_m
        frames = np.arange(len(points))
        state_frames, state = np.array(self.states).T
        np.savez_compressed(
            file,
            points=points[..., :2],
            rate_hz=self.rate_hz,
            length_m=self.length_m,
            name=name,
            source=source,
            licence="made by snakewalk animal synthesise",
            height_m=points[..., 2],
            radius_m=self.half_height_m,
            speed_m_s=self.plan.speed_m_s,
            tongue=self.tongue,
            state=state[np.searchsorted(state_frames, frames, side="right") - 1],
        )


@dataclass(frozen=True, slots=True)
class _Curves:
    """The behaviour at every frame."""

    sliding: Floats
    pulse_m_s: Floats
    head_held: Floats
    calm_tail: Floats


class SnakeSynthesis:
    """The motion of one run's configuration; each step is made at its first use."""

    def __init__(self, prepared: WalkRun, tongue: TongueRecord | None = None) -> None:
        self.prepared = prepared
        self.tongue = TongueRecord.made_up() if tongue is None else tongue
        self.run = prepared.run
        self.how: SynthesisConfig = prepared.run.synthesis
        self.dt_s = 1.0 / self.how.rate_hz
        self.segment_m = prepared.robot.length_m / POINTS

    @cached_property
    def shape_filters(self) -> dict[str, ShapeFilter]:
        """Tests of a state."""
        tests = self.prepared.shape_filters
        return tests if self.how.for_robot else {name: tests[name] for name in _ANIMAL}

    @cached_property
    def library(self) -> StateLibrary:
        """States with the waves of the behaviour."""
        return build_library(
            load_track(self.run.track).angles_rad,
            self.shape_filters,
            coefficients=self.how.coefficients,
            random_count=self.run.states.random_count,
            curvature=self.run.behaviour.curvature,
            rng=np.random.default_rng(self.run.seed),
            waves=self.how.waves,
        )

    @cached_property
    def path(self) -> SplinePath:
        """Over safe ground through the waypoints."""
        return self.prepared.path

    @cached_property
    def ground_step(self) -> GroundStep:
        """Places skeletons on the world's ground."""
        return GroundStep(self.prepared.ground)

    def synthesise(self, frames: int | None = None) -> SynthesisedWalk:
        """Synthesise a motion until the last target, or for a number of frames on the map.

        Beyond the path, the motion ends when the head leaves the ground of the world. Before the
        last target it ends when the whole body has left it.

        Raises:
            InputError: the run's time limit allows more than ``FRAMES_MAX``.

        """
        run = self.run
        how = self.how
        robot = self.prepared.robot
        if frames is None and run.time_limit_s * how.rate_hz > FRAMES_MAX:
            raise InputError(
                f"run {run.name}: time_limit_s: {run.time_limit_s:g} s at {how.rate_hz:g} Hz are "
                f"over {FRAMES_MAX} frames, the most of a motion; shorten it"
            )
        most = round(run.time_limit_s * how.rate_hz) if frames is None else frames
        targets = Targets(
            self.path,
            np.array(run.waypoints_m),
            run.waypoint_radius_m,
            how.target_spacing_m,
            run.walk.carrot_m,
            lambda *points: at_once(self.prepared.planner.in_steps(*points)),
        )
        curves = _Curves(
            self._values_along_body(how.sliding, how.sliding_along, most),
            self._values_along_body(how.pulse_m_s, how.pulse_along, most)
            + self._varied_amplitude(most),
            curve_at(how.head_held, np.arange(most) * self.dt_s),
            curve_at(how.calm_tail, np.arange(most) * self.dt_s),
        )

        def until(points_m: Floats) -> bool:
            reached = targets.observe(points_m)
            if frames is None:
                return reached
            on_map = self.prepared.on_map(points_m)
            return not (on_map[0] if reached else on_map.any())

        if run.motion == "kp":
            plan, states = self._on_graph(most, until)
        else:
            plan, states = self._on_star(most, targets, curves, until)
        frame_count = len(plan.speed_m_s)
        half_m = half_heights_m(robot, POINTS)
        return SynthesisedWalk(
            plan,
            self._on_ground(plan, half_m),
            half_m,
            how.rate_hz,
            self.path,
            targets,
            states,
            self.library,
            curves.sliding[:frame_count],
            curves.pulse_m_s[:frame_count],
            curves.head_held[:frame_count],
            curves.calm_tail[:frame_count],
            self._tongue(frame_count),
            f"{self.tongue.source} ({self.tongue.evidence})",
        )

    def _on_ground(self, plan: Locomotion, half_m: Floats) -> GroundedSkeleton:
        """[PT] 2.6.5: the plan's skeletons on the ground of the world."""
        if self.how.ground is Adaptation.HEIGHT:
            return self.ground_step.lift(plan.points_m, half_m)
        return self.ground_step.place(plan.angles_rad, plan.points_m[:, -1], self.segment_m, half_m)

    def _on_star(
        self, most: int, targets: Targets, curves: "_Curves", until: Callable[[Floats], bool]
    ) -> tuple[Locomotion, list[tuple[int, int]]]:
        """[PT] 2.6: a star of states around the present one, aimed at the targets."""
        run = self.run
        printed = run.motion == "walk-printed"
        walker = self._with_share.walker(self.library, self.shape_filters)
        heading_rad = self.prepared.start_heading_rad
        states = [(0, 0)]
        next_frame = [0]

        def observe(frame: int, points_m: Floats) -> bool:
            next_frame[0] = frame + 1
            return until(points_m)

        def grow(_: AngleTrack, points_m: Floats) -> None:
            mean_rad = heading_rad + float(walker.track.body_rad(walker.track.end).mean())
            aim_rad = (
                targets.printed_aim_rad(points_m)
                if printed
                else targets.aim_rad(points_m, mean_rad)
            )
            states.append((next_frame[0], walker.decide(heading_rad, aim_rad).state))

        plan = synthesise(
            walker.track,
            self.law,
            most,
            Sampling(self.dt_s, self.segment_m),
            grow,
            Behaviour(
                sliding=lambda t: curves.sliding[t],
                pulse_m_s=lambda t: curves.pulse_m_s[t],
                head_held=lambda t: curves.head_held[t],
                calm_tail=lambda t: curves.calm_tail[t],
            ),
            start=Start(run.start_m, heading_rad),
            until=observe,
        )
        return plan, states

    @property
    def _with_share(self) -> WalkRun:
        share = self.how.state_share
        if share is None:
            return self.prepared
        walk = self.run.walk.model_copy(update={"decision_fraction": share})
        return replace(self.prepared, run=self.run.model_copy(update={"walk": walk}))

    def _on_graph(
        self, most: int, until: Callable[[Floats], bool]
    ) -> tuple[Locomotion, list[tuple[int, int]]]:
        """[KP] 4.2.1: a walk on the fixed graph, the mass centre on the path."""
        states: list[tuple[int, int]] = []
        plan = graph_motion(
            self._graph_shapes(),
            self.path,
            most,
            self.segment_m,
            self.dt_s,
            lambda _, points_m: until(points_m),
            lambda frame, state: states.append((frame, state)),
        )
        return plan, states

    def _graph_shapes(self) -> Iterator[tuple[int, Floats]]:
        """States and angles A_c of [KP] 4.2.1: consecutive frames, and random states between.

        Raises:
            InputError: the library has no consecutive frames, or no wave to the tail.

        """
        run = self.run
        library = self.library
        track = load_track(run.track)
        number = np.rint(track.time_s * track.rate_hz).astype(np.int64)[library.frame]
        pulse = analyse(track).pulse
        is_known = np.isfinite(pulse.body_points_per_frame)
        speeds = np.interp(
            library.frame, pulse.frame[is_known], pulse.body_points_per_frame[is_known]
        )
        states = to_states(library.shapes_rad[: library.recorded], self.how.coefficients)
        try:
            film = FilmStates(states, number, speeds)
        except ValueError as fault:
            raise InputError(
                f"run {run.name}: track {run.track}: {fault}; use --motion walk, or a track "
                "of successive frames without [synthesis.waves]"
            ) from None
        rng = np.random.default_rng(run.seed)
        film = with_random_states(film, POINTS, run.states.random_count, self._is_possible, rng)
        self.library = replace(library, shapes_rad=to_angles(film.states, POINTS))
        return film_angles(film, POINTS, rng)

    def _is_possible(self, shapes_rad: Floats) -> bool:
        return not any(refuses(shapes_rad).any() for refuses in self.shape_filters.values())

    @property
    def law(self) -> SpeedLaw:
        """The speed law in metres."""
        how = self.how
        unit_m = self.how.length_unit_m
        return SpeedLaw(how.viscous, how.coulomb * unit_m, how.bend * unit_m, how.turn * unit_m)

    def _values_along_body(self, curve: Curve, along: Along, frames: int) -> Floats:
        """(frames, N) values of a curve over time and along the body."""
        return curve_at(curve, np.arange(frames) * self.dt_s)[:, None] * along_body(along, POINTS)

    def _varied_amplitude(self, frames: int) -> Floats | float:
        how = self.how
        if how.pulse_spread_m_s == 0.0:
            return 0.0
        rng = np.random.default_rng([self.run.seed, 1])
        return varied_pulse(
            POINTS, frames, how.pulse_parts, how.pulse_spread_m_s, how.pulse_step_m_s, rng
        )

    def _tongue(self, frames: int) -> Floats:
        """Heights at the frames: the chain plays b_st times as fast."""
        speed = curve_at(self.how.tongue_speed, np.arange(frames) * self.dt_s)
        tongue = Tongue(HeightChain(self.tongue.heights), self.run.seed, self.tongue.rate_hz)
        return np.array([tongue.height(t) for t in np.cumsum(speed) * self.dt_s])
