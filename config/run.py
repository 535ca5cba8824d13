"""Description of a run: robot, world, recording, waypoints, motion and safety."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from snakewalk.config.base import Name, Share, Strict
from snakewalk.config.camera import CameraConfig, MappingConfig, PoseName
from snakewalk.config.compliance import ComplianceConfig
from snakewalk.config.constants import DEFAULT_ROBOT, DEFAULT_WORLD
from snakewalk.config.friction_law import LawName
from snakewalk.config.gait import GaitConfig
from snakewalk.config.key_types import SEED, Seed
from snakewalk.config.playback import PlaybackConfig
from snakewalk.config.robot import RobotConfig, ServoConfig
from snakewalk.config.schedule import RepertoireConfig
from snakewalk.config.synthesis import SynthesisConfig
from snakewalk.config.value_faults import STOP_OUTPUT_PATTERN

MOTIONS = (
    "walk",
    "walk-printed",
    "walk-blind",
    "kp",
    "serpenoid",
    "gait",
    "playback",
    "repertoire",
    "source",
)
"""Names of the motions that need no plug-in."""
WALKS = frozenset({"walk", "walk-printed", "walk-blind", "kp", "serpenoid"})
"""Names of the motions that follow waypoints."""
MotionName = Annotated[str, Field(pattern=r"^[a-z][a-z0-9_-]*$", max_length=100)]
"""A motion of ``MOTIONS``, or the name of a plug-in."""


Place = Annotated[float, Field(ge=-1000.0, le=1000.0)]
"""Coordinate of a waypoint or of the start, m."""


class StatesConfig(Strict):
    """The library of body shapes ([PT] 2.5)."""

    coefficients: int = Field(
        4, ge=1, le=20, description="number of principal components that describe a body shape"
    )
    random_count: int = Field(
        200,
        ge=0,
        le=100_000,
        description="number of random body shapes in addition to the recorded ones",
    )
    gain_limit: float = Field(
        0.6, ge=0.0, le=1.0, description="least quasi-static efficiency eta_q of a body shape"
    )
    turn_limit_rad: float = Field(
        1.5,
        gt=0.0,
        description="largest angle between the tail of a body shape and its mean direction",
    )


class PitchConfig(Strict):
    """How the servos of the pitch joints are set up in a walk; by default as the robot says."""

    p_gain: int | None = Field(
        None, ge=0, le=16383, description="Position P Gain of the pitch joints (register 84)"
    )
    current_limit_a: float | None = Field(
        None,
        gt=0.0,
        description="Goal Current of the pitch joints; a body that rolls needs at least 0.3 A",
    )
    lead_s: float | None = Field(
        None, ge=0.0, le=2.0, description="time by which goals of the pitch joints are sent early"
    )
    fit_gain: float = Field(
        1.0, gt=0.0, le=2.0, description="factor on the goals that fit the body to the ground"
    )

    def set_up(self, robot: RobotConfig) -> RobotConfig:
        """Return the robot with these settings; settings of single joints stay."""
        given = {
            "pitch_p_gain": self.p_gain,
            "pitch_current_limit_a": self.current_limit_a,
            "pitch_lead_s": self.lead_s,
        }
        changes = {key: value for key, value in given.items() if value is not None}
        return robot.model_copy(update={"servo": robot.servo.model_copy(update=changes)})


class WalkConfig(Strict):
    """How states follow each other and how the measured pose steers (docs/method.md)."""

    decision_fraction: float = Field(
        1.0,
        gt=0.05,
        le=1.0,
        description="share of a state that the body walks before the next decision",
    )
    proposals: int = Field(
        120,
        ge=1,
        le=1000,
        description="number of states, the first in the order of W, from which "
        "candidates are drawn",
    )
    candidates: int = Field(
        6, ge=1, le=50, description="number of candidates to simulate, the smoothest first"
    )
    climb_progress: float = Field(
        0.65, ge=0.0, le=1.0, description="predicted progress below which states ride on wide waves"
    )
    climb_share: float = Field(
        0.2, ge=0.0, le=1.0, description="share of a state that rides on a wide wave"
    )
    bend_limit_rad: float = Field(
        2.4, ge=0.0, description="largest turn of the mean line over a body length"
    )
    carrot_m: float = Field(
        0.6, gt=0.05, description="distance ahead on the path at which states aim"
    )
    heading_tolerance_rad: float = Field(
        0.5,
        gt=0.0,
        description="largest angle between a body shape and the requested direction",
    )
    nearest_count: int = Field(
        12, ge=1, description="number of nearest states to try if no state is within the tolerance"
    )
    ramp_limit_rad: float = Field(
        0.8, ge=0.0, description="heading error that a ramp cancels on a piece; for walk-blind only"
    )
    rolls: bool = Field(
        True,
        description="a body that has missed its way and climbs badly rolls up the slope sideways, "
        "if it is round and its pitch joints carry it",
    )
    tries: int = Field(
        8,
        ge=0,
        le=50,
        description="number of pieces that a second simulated body tries if the "
        "best one fails, in simulation on slopes over 8 degrees; 0: "
        "none, and rolls are on paper",
    )
    finds_friction: bool = Field(
        True,
        description="use the friction estimated during the run if the file's value is wrong; "
        "false: always use the file's value",
    )
    pitch: PitchConfig = PitchConfig()
    fallback: bool = Field(
        True,
        description="follow a serpenoid after the second miss of a waypoint until "
        "the body reaches it",
    )


class BehaviourConfig(Strict):
    """Behaviour that a user may change ([PT] 2.6.6)."""

    pulse_body_lengths_s: float = Field(
        0.25,
        gt=0.0,
        le=3.0,
        description="speed of the walk: body lengths that the wave travels in a second",
    )
    sliding: Share = Field(
        0.0, description="share of the pulse speed that is lost by sliding (w_d)"
    )
    curvature: float | None = Field(
        None,
        gt=0.0,
        le=2.0,
        description="factor on the bends of every shape; default: 1, and more if "
        "the ground's friction is too low for narrow bends",
    )


class SafetyConfig(Strict):
    """Limits below the controller; a command beyond them is clamped, or vetoed and latched."""

    goal_rate_rad_s: float = Field(
        4.0, gt=0.0, description="largest speed at which a joint's goal may move"
    )
    goal_lead_rad: float = Field(
        0.8, gt=0.0, description="largest difference between a joint's goal and its measured angle"
    )
    following_limit_rad: float = Field(
        0.4,
        gt=0.0,
        description="distance from its goal beyond which a joint does not follow; "
        "at most 0.9 of goal_lead_rad, larger for a low P gain",
    )
    following_time_s: float = Field(
        0.5, ge=0.0, description="time for which a joint may exceed following_limit_rad"
    )
    current_limit_a: float | None = Field(
        None,
        gt=0.0,
        description="servo current at which torque goes off; default: the robot's "
        "servo.over_current_a",
    )
    current_time_s: float = Field(
        0.5, ge=0.0, description="time for which a servo may exceed current_limit_a"
    )
    temperature_limit_c: float = Field(
        70.0, gt=0.0, description="temperature of a servo's housing at which torque goes off"
    )
    winding_limit_c: float = Field(
        125.0,
        gt=0.0,
        description="largest estimated temperature of a motor's winding, from the "
        "housing's temperature and the current's heat",
    )
    voltage_min_v: float | None = Field(
        None,
        gt=0.0,
        description="supply voltage below which torque goes off; default: the "
        "robot's servo.supply_min_v",
    )
    voltage_max_v: float | None = Field(
        None,
        gt=0.0,
        description="supply voltage above which torque goes off; default: the "
        "robot's servo.supply_max_v",
    )
    voltage_time_s: float = Field(
        0.3,
        ge=0.0,
        description="time for which the supply voltage may be too low, except at the start",
    )
    stale_limit_s: float = Field(
        0.1,
        gt=0.0,
        description="largest age of a measured position, velocity or current; if not given, slow "
        "replies raise it up to 0.25",
    )
    slow_stale_limit_s: float = Field(
        3.0,
        gt=1.0,
        description="largest age of a measured temperature or voltage; overdue after 1 s",
    )
    on_trip: Literal["off", "hold"] = Field(
        "off",
        description="reaction of a lifted or climbing body to a joint that does "
        "not follow or to Ctrl-C: torque off, or hold_s with a low "
        "current first; all other trips switch torque off at once",
    )
    hold_s: float = Field(
        5.0, gt=0.0, le=60.0, description="time for which on_trip = hold holds the joints"
    )
    hold_current_a: float | None = Field(
        None,
        gt=0.0,
        description="current of each joint while on_trip = hold holds it; default: "
        "0.2 of its stall current",
    )
    stop_output: str | None = Field(
        None,
        pattern=STOP_OUTPUT_PATTERN,
        description="activated if torque off is not confirmed: rts:PORT or dtr:PORT sets this line "
        "of a serial port, -rts:PORT or -dtr:PORT clears it, command:/PROGRAM ARGUMENT starts a "
        "program; a simulated run opens the simulated supply",
    )
    advance_fraction: Share = Field(
        0.5,
        description="share of the expected advance below which the run raises an alarm",
    )
    watchdog_s: float = Field(
        0.2,
        ge=0.02,
        le=2.54,
        description="time without instructions after which servos stop by "
        "themselves (register 98, in steps of 20 ms)",
    )
    recovery: Literal["stop", "confirm", "resume"] = Field(
        "stop",
        description="reaction to a vanished port or a rebooted servo: torque off, ask, or go on",
    )
    lost_observer: Literal["stop", "warn"] = Field(
        "stop",
        description="reaction if a page, ROS node or gamepad with an E-STOP ends "
        "or does not respond: torque off, or a warning",
    )
    recovery_time_s: float = Field(
        10.0, gt=0.0, description="time to wait for a vanished port or a rebooted servo"
    )
    overload_reboots: int = Field(
        0,
        ge=0,
        le=10,
        description="number of times per run that a servo in overload shutdown is "
        "rebooted and moved on slowly; 0: torque off",
    )

    def following_limits_rad(self, robot: RobotConfig) -> tuple[float, ...]:
        """Largest distance of each joint from its goal, rad, head first.

        A yaw joint or a leg's joint may lag by the error at which its P gain gives full output, the
        largest lag without a fault. The limit is twice that, but at least ``following_limit_rad``.
        A pitch joint has ``following_limit_rad``: its current shows whether the ground holds it
        off.
        """
        most_rad = 0.9 * self.goal_lead_rad
        limits_rad = []
        columns = robot.all_axes, robot.position_p_gains, robot.servo_records
        for axis, gain, facts in zip(*columns, strict=True):
            full_rad = facts.full_output_rad / max(gain, 1) if axis != "p" else 0.0
            limits_rad.append(min(max(self.following_limit_rad, 2.0 * full_rad), most_rad))
        return tuple(limits_rad)

    def current_limit_of_a(self, robot: RobotConfig) -> float:
        """Greatest lasting current of a robot's servos: the run's, else the robot's."""
        return robot.over_current_a if self.current_limit_a is None else self.current_limit_a

    def voltage_limits_v(self, servo: ServoConfig) -> tuple[float, float]:
        """Least and greatest supply voltage of the servos: the run's, else the robot's."""
        low_v, high_v = servo.supply_limits_v
        return (
            low_v if self.voltage_min_v is None else self.voltage_min_v,
            high_v if self.voltage_max_v is None else self.voltage_max_v,
        )


class DeviationConfig(Strict):
    """Differences of a simulated robot and its ground from the values that plan and motion use."""

    friction_along: float = Field(
        1.0,
        gt=0.0,
        le=10.0,
        description="factor on the world's friction along the body, forward and backward",
    )
    friction_across: float = Field(
        1.0, gt=0.0, le=10.0, description="factor on the world's friction across the body"
    )
    friction_law: LawName | None = Field(
        None, description="law of friction of the ground; default: the world's"
    )
    mass: float = Field(1.0, gt=0.0, le=10.0, description="factor on the mass of every link")
    torque: float = Field(
        1.0,
        gt=0.0,
        le=10.0,
        description="factor on the torque that every servo gives for a current",
    )
    drawn: bool = Field(
        False,
        description="draw the errors of `trials rehearse --errors` from the seed instead",
    )


class RunConfig(Strict):
    """One run of the main job."""

    name: Name
    robot: str = Field(DEFAULT_ROBOT, description="a shipped robot's name or a TOML path")
    world: str = Field(DEFAULT_WORLD, description="a shipped world's name or a TOML path")
    track: str = Field("worm-like", description="a shipped recording's name or a file")
    motion: MotionName = Field(
        "walk",
        description="kp: on paper only, `snakewalk animal synthesise`; source: a motion source of "
        "your own, run by `prepare_source`",
    )
    waypoints_m: tuple[tuple[Place, Place], ...] = Field(
        (),
        max_length=1000,
        description="waypoints in their order; playback and source need no "
        "waypoints; a gait of legs follows the path through them",
    )
    start_m: tuple[Place, Place] = Field((0.0, 0.0), description="place of the head at the start")
    start_heading_rad: float | None = Field(
        None, description="heading of the body at the start; default: towards the path"
    )
    waypoint_radius_m: float = Field(
        0.3, gt=0.0, description="distance from a waypoint at which it counts as reached"
    )
    seed: Seed = SEED
    cycle_hz: float = Field(50.0, gt=0.0, le=1000.0, description="control cycles per second")
    physics_step_s: float | None = Field(
        None, ge=2e-5, le=0.01, description="default: 0.002 on a floor, 0.001 on a height field"
    )
    time_limit_s: float = Field(
        240.0, gt=0.0, description="time after which the run ends, although waypoints are left"
    )
    states: StatesConfig = StatesConfig()
    walk: WalkConfig = WalkConfig()
    behaviour: BehaviourConfig = BehaviourConfig()
    safety: SafetyConfig = SafetyConfig()
    gait: GaitConfig | None = Field(
        None, description='a table [gait], for motion = "gait": the gait and its parameters'
    )
    playback: PlaybackConfig | None = Field(
        None, description='a table [playback], for motion = "playback": how a recording is replayed'
    )
    repertoire: RepertoireConfig | None = Field(
        None,
        description='a table [repertoire], for motion = "repertoire": recorded actions',
    )
    compliance: ComplianceConfig | None = Field(
        None,
        description="a table [compliance]: joints yield to measured current; default: they do not",
    )
    pose: PoseName | None = Field(
        None,
        description="source of the head's pose; default: the simulator, on servos the robot's IMU, "
        "or the joints",
    )
    deviation: DeviationConfig = Field(
        DeviationConfig(),
        description="deviation of the simulated body and ground from their files, "
        "hidden from the run",
    )
    camera: CameraConfig = CameraConfig()
    mapping: MappingConfig | None = Field(
        None,
        description="a table [mapping]: the ground is not known before the run, the robot's stereo "
        "head maps it on the way; default: the walk knows the world's ground",
    )
    synthesis: SynthesisConfig = SynthesisConfig()

    @property
    def pose_is_true(self) -> bool:
        """Whether the simulator gives the head's pose, without error."""
        return self.pose in (None, "simulator")

    @model_validator(mode="after")
    def _motion_has_its_table(self) -> Self:
        if self.motion == "gait" and self.gait is None:
            raise ValueError("motion gait needs a table [gait] with its name")
        if self.gait is not None and self.gait.ashore is not None and not self.waypoints_m:
            raise ValueError("gait.ashore: needs waypoints; add waypoints_m or remove ashore")
        planned = self.motion == "repertoire" and not self.repertoire
        if (planned or self.motion in WALKS) and not self.waypoints_m:
            raise ValueError("waypoints_m: at least one is needed")
        return self
