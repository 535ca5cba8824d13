"""Tags on the links and one calibrated camera as a pose source: ``--pose tags``."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.extras import require_extra
from snakewalk.config.pose import PoseConfig
from snakewalk.config.robot import RobotConfig
from snakewalk.config.run import RunConfig
from snakewalk.config.tags import FixedTag
from snakewalk.config.world import WorldConfig
from snakewalk.controller.cameras.tags.tag_camera import (
    DeviceTags,
    SimulatedTags,
    TagPictures,
    first_picture,
)
from snakewalk.controller.cameras.tags.tag_detector import TagDetector, TagPicture
from snakewalk.controller.cameras.tags.tag_fit import TagFit
from snakewalk.controller.cameras.tags.tag_view import TagView
from snakewalk.controller.console.command import plugin
from snakewalk.controller.pose.external_pose import ExternalPose
from snakewalk.controller.pose.first_pose import start_fault
from snakewalk.controller.pose.motion_history import Moment, MotionHistory
from snakewalk.controller.pose.sample import ArrivedPose, PoseSample, UnusablePoseError
from snakewalk.controller.run.external.external_source import ground_height
from snakewalk.controller.run.pose_provider import PoseContext, PoseProvider
from snakewalk.controller.runlog.evidence import Kind, PoseEvidence
from snakewalk.controller.runtime.pose_hold import PoseHealth
from snakewalk.drivers.types import BodyPose, JointState

WORLD = "world"


@plugin("pose", "tags")
class TagsPose:
    """Printed tags on the links, seen by one calibrated camera in any position."""

    def faults(
        self, run: RunConfig, robot: RobotConfig, world: WorldConfig, *, on_port: bool
    ) -> list[str]:
        """Return why the tags cannot give the pose here, one line per fault."""
        require_extra("pose: tags need", "cv2")
        faults = []
        camera = run.camera
        if robot.tags is None:
            faults.append(
                f"pose: tags: robot {robot.name} has no tags; add a table [tags] "
                "(docs/how-to/tags.md)"
            )
        if camera.place_m is None and not (camera.fixed_tags and on_port):
            faults.append(
                "pose: tags: the place of the camera is unknown; set camera.place_m and "
                f"camera.aim_m{', or camera.fixed_tags' if on_port else ''}"
            )
        if on_port:
            faults += [
                f"pose: tags: camera.{key} is missing; {advice}"
                for key, advice in (
                    ("device", "set the number, device or address of the camera"),
                    ("lens", "calibrate it with snakewalk pose lens"),
                )
                if getattr(camera, key) is None
            ]
        try:
            _detector(robot, camera.fixed_tags)
        except InputError as error:
            faults += error.faults
        return faults

    def evidence(self, run: RunConfig, robot: RobotConfig) -> PoseEvidence:
        """Return that the tags measure the pose."""
        return PoseEvidence(Kind.MEASURED, "tags")

    @contextmanager
    def open(self, context: PoseContext) -> Iterator[PoseProvider]:
        """Open the camera for a run; waits for the first tags before torque.

        Raises:
            InputError: the camera is missing, shows no tag, or shows the robot elsewhere.

        """
        run = context.prepared.run
        robot = context.prepared.robot
        assert robot.tags is not None
        # the tags give the head in the world: ignore another source's mounting
        config = (robot.pose or PoseConfig()).model_copy(
            update={
                "link": 0,
                "offset_m": (0.0,) * 3,
                "offset_deg": (0.0,) * 3,
                "world_m": (0.0,) * 3,
                "world_deg": (0.0,) * 3,
                "frame": WORLD,
            }
        )
        with closing(_pictures(context)) as pictures:
            first = first_picture(pictures, context.backend.clock)
            view = TagView.of(run.camera)
            if not view.is_placed:
                view = view.placed_by(first.corners_px, run.camera.fixed_tags, robot.tags.side_m)
            fit = TagFit(robot, view)
            _check_start(context, fit, first, config)
            feed = TagFeed(robot, pictures, fit)
            pose = ExternalPose(
                robot,
                config,
                feed,
                context.reckoning,
                lambda text: context.on_event("pose", text),
                is_level=context.prepared.ground is None,
            )
            source = _NotedJoints(feed, pose)
            health = PoseHealth(pose.fault, config.hold_s, pose.row, pose.needs_caution)
            yield PoseProvider(
                source, lambda: pose.facts() | feed.facts(), health, pose.take_measured
            )


class TagFeed:
    """Head poses from pictures and the joint angles at their times."""

    def __init__(self, robot: RobotConfig, pictures: TagPictures, fit: TagFit) -> None:
        self._pictures = pictures
        self._fit = fit
        self._joints = MotionHistory(robot.joint_count)
        self._before: Floats | None = None
        self._sequence = self._tags = self._used = 0

    def note(self, state: JointState) -> None:
        """Store the joint angles of a state."""
        angles = np.array(state.position_rad)
        self._joints.add(Moment(state.time_s, np.zeros(3), angles))

    def arrived(self, now_s: float) -> Sequence[ArrivedPose]:
        """Return the poses of the pictures since the last call."""
        return [self._pose_of(picture) for picture in self._pictures.arrived(now_s)]

    def facts(self) -> dict[str, float | int]:
        """Numbers for a command's result."""
        mean = self._tags / self._used if self._used else 0.0
        return {"pictures": self._sequence, "tags_per_pose": round(mean, 1)}

    def _pose_of(self, picture: TagPicture) -> ArrivedPose:
        self._sequence += 1
        joint_rad = self._joints.at(picture.time_s).joint_rad
        head_fit = self._fit.fit(picture.corners_px, joint_rad, self._before)
        if head_fit is None:
            why = "no tag is in the picture; uncover the tags, or move the camera"
            if picture.corners_px:
                why = "the tags do not fit the joints; check tags.on and the camera's place"
            return ArrivedPose(picture.time_s, "tags", UnusablePoseError(why))
        self._before = head_fit.rotation
        self._tags += len(head_fit.tags)
        self._used += 1
        sample = PoseSample(
            self._sequence,
            picture.time_s,
            head_fit.position_m,
            head_fit.rotation,
            WORLD,
            head_fit.covariance,
        )
        return ArrivedPose(picture.time_s, "tags", sample)


class _NotedJoints:
    """Passes each joint state to the feed before the pose is computed."""

    def __init__(self, feed: TagFeed, pose: Callable[[JointState], BodyPose]) -> None:
        self._feed = feed
        self._pose = pose

    def __call__(self, state: JointState) -> BodyPose:
        self._feed.note(state)
        return self._pose(state)


def _detector(robot: RobotConfig, fixed: Sequence[FixedTag]) -> TagDetector:
    if robot.tags is None:
        return TagDetector("4X4_50", ())
    numbers = [tag.id for tag in robot.tags.on] + [tag.id for tag in fixed]
    return TagDetector(robot.tags.dictionary, numbers)


def _pictures(context: PoseContext) -> TagPictures:
    prepared = context.prepared
    backend = context.backend
    run = prepared.run
    robot = prepared.robot
    detector = _detector(robot, run.camera.fixed_tags)
    qpos = backend.qpos
    head = backend.pose
    if qpos is None or head is None:
        return DeviceTags(run.camera, detector, backend.clock, context.on_picture)
    return SimulatedTags(
        robot,
        run.camera,
        detector,
        lambda: (head(), qpos()[7:]),
        backend.clock,
        context.on_picture,
        run.seed,
    )


def _check_start(context: PoseContext, fit: TagFit, first: TagPicture, config: PoseConfig) -> None:
    """Compare a tag of the first picture with the start; joint angles are not known yet.

    Raises:
        InputError: only fixed tags are seen, or the robot is elsewhere.

    """
    run = context.prepared.run
    robot = context.prepared.robot
    alone = fit.of_link(first.corners_px)
    if alone is None:
        raise InputError("pose tags: no tag of the robot is in the picture; turn it, or the camera")
    link, head_fit = alone
    sample = PoseSample(0, first.time_s, head_fit.position_m, head_fit.rotation, WORLD)
    fault = start_fault(
        sample,
        robot,
        config.model_copy(update={"link": link}),
        run.start_m,
        ground_height(context.prepared.ground),
    )
    if fault is not None:
        raise InputError(f"pose tags: {fault}")
