"""The skin of a synthesised motion: as an animated glTF, and in a film on the world's ground."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from snakewalk.config.arrays import Floats, Image
from snakewalk.config.robot import RobotConfig
from snakewalk.controller.animals.mesh.body_look import animal, rig_look
from snakewalk.controller.animals.mesh.body_motion import robot_skin
from snakewalk.controller.animals.mesh.body_skin import BodySkin, body_skin
from snakewalk.controller.animals.mesh.rig import Rig, spine_rig
from snakewalk.controller.animals.mesh.skin import Skin
from snakewalk.controller.animals.mesh.skin_file import write_skin
from snakewalk.controller.animals.synthesis.snake_synthesis import SynthesisedWalk
from snakewalk.controller.animals.synthesis.tongue_skin import (
    bones_with_tongue,
    rig_with_tongue,
)
from snakewalk.controller.console.progress import ProgressBar
from snakewalk.controller.console.result_files import atomic_write
from snakewalk.controller.report.film import FPS, SIZE, renderer, speed_up
from snakewalk.controller.run.kinds.walk_run import WalkRun
from snakewalk.controller.run.results import ANIMAL
from snakewalk.controller.track.bone_motion import BoneMotion
from snakewalk.sim.rendering.looks import SkinLook

FILM_SEGMENTS = 5
"""Segments of the skeleton in one bone of the film; the file has a bone a segment."""


@dataclass(frozen=True, slots=True)
class SynthesisSkin:
    """A skin of the robot's size, and its texture."""

    dressed: BodySkin
    skin: Skin
    tongue: bool
    """Whether it shows its tongue: a snake, or a recorded body."""

    @classmethod
    def of(cls, look: str, track: str, robot: RobotConfig) -> "SynthesisSkin":
        """Make ``animal``, which is the recording's own body or a plain snake, or a BODY.

        Raises:
            InputError: no such body, or an extra is missing.

        """
        dressed = body_skin(animal(track) if look == ANIMAL else look)
        return cls(dressed, robot_skin(dressed.skin, robot), look in (ANIMAL, "snake"))

    def write(self, walk: SynthesisedWalk, file: Path) -> None:
        """Write the animated glTF, ``file`` ends in .glb."""
        worn = self.dressed
        rig, bones, texture = self._rig(walk, 1)
        with atomic_write(file) as part:
            write_skin(part, rig, bones, texture, worn.name, both_sides=worn.both_sides)

    def _rig(self, walk: SynthesisedWalk, segments: int) -> tuple[Rig, BoneMotion, Image | None]:
        bones = walk.bones(segments)
        texture = self.dressed.texture
        rig = spine_rig(self.skin, bones.bone_m)
        if not self.tongue:
            return rig, bones, texture
        rig, texture = rig_with_tongue(rig, bones.length_m, texture)
        return rig, bones_with_tongue(bones, walk.tongue), texture

    def film(self, walk: SynthesisedWalk, prepared: WalkRun, file: Path) -> int:
        """Draw the film, ``file`` ends in .mp4; shows progress on standard error.

        Raises:
            InputError: the simulator or PyAV is not installed, or nothing draws here.

        """
        rig, bones, texture = self._rig(walk, FILM_SEGMENTS)
        return film_over(
            prepared,
            file,
            bones,
            rig_look(rig, texture, spine=walk.bones(FILM_SEGMENTS).front_m.shape[1]),
            robot=prepared.robot,
            reached_s=walk.reached_s(),
            paths=walk.targets.paths(walk.rate_hz),
            title=prepared.run.name,
        )


def film_over(
    prepared: WalkRun,
    file: Path,
    bones: BoneMotion,
    look: "SkinLook",
    *,
    robot: RobotConfig,
    reached_s: Sequence[float],
    paths: Sequence[tuple[float, Floats]],
    title: str,
) -> int:
    """Draw a skin that moves over a run's world; shows progress on standard error.

    Args:
        prepared: the run.
        file: ends in .mp4.
        bones: the motion.
        look: the skin.
        robot: the body in the camera's frame, of the skin's length.
        reached_s: time at each waypoint.
        paths: paths (P, 2) from a time on.
        title: in the picture.

    Returns:
        The number of frames.

    Raises:
        InputError: the simulator or PyAV is not installed, or nothing draws here.

    """
    run = prepared.run
    film = renderer()
    frames, count = bones.front_m.shape[:2]
    turns = Rotation.from_matrix(bones.rotation.reshape(-1, 3, 3)).as_quat(scalar_first=True)
    poses = np.concatenate([bones.front_m, turns.reshape(frames, count, 4)], axis=2)
    with atomic_write(file) as part, ProgressBar("film", transient=True) as bar:
        drawn: int = film.render_film(
            film.Scene(robot, prepared.world, prepared.ground),
            bones.time_s,
            poses.reshape(frames, -1),
            part,
            style=film.Style(FPS, speed_up(float(bones.time_s[-1])), SIZE, title, look),
            marks=film.Marks(run.waypoints_m, run.waypoint_radius_m, reached_s, paths),
            on_frame=bar.update,
        )
        return drawn
