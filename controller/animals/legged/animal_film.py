"""The body of an animal with legs in a film on the world's ground, and as animated glTF."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from snakewalk.config.animal import AnimalConfig, SkinConfig
from snakewalk.config.arrays import Image
from snakewalk.config.loader import load, locate
from snakewalk.controller.animals.legged.animal_rig import animal_bones, animal_rig
from snakewalk.controller.animals.legged.animal_synthesis import SynthesisedAnimal, as_long_robot
from snakewalk.controller.animals.legged.prototype import SEGMENTS
from snakewalk.controller.animals.mesh.body_look import rig_look
from snakewalk.controller.animals.mesh.body_skin import Cut, shipped_skin
from snakewalk.controller.animals.mesh.rig import Rig
from snakewalk.controller.animals.mesh.skin_file import write_skin
from snakewalk.controller.animals.synthesis.synthesis_skin import FPS, film_over
from snakewalk.controller.console.result_files import atomic_write
from snakewalk.controller.run.kinds.walk_run import WalkRun

_FRAMED_LENGTH = 1.2
"""Length in the camera's frame over the body's: legs and horns add to it."""
_FRAMES = 12
"""Frames of a cycle that show each step of a foot (ours)."""


@dataclass(frozen=True, slots=True)
class AnimalBody:
    """An animal's parts on its bones, and their skins."""

    rig: Rig
    texture: Image | None

    @classmethod
    def of(cls, animal: AnimalConfig) -> "AnimalBody":
        """Make the body.

        Raises:
            InputError: no such skin, or an extra is missing.

        """
        config = load(locate("skins", animal.skin), SkinConfig)
        worn = shipped_skin(config, Cut())
        rig = animal_rig(animal, worn.skin.sized(animal.length_m), config.bands)
        return cls(rig, worn.texture)

    def write(self, animal_motion: SynthesisedAnimal, file: Path) -> None:
        """Write the animated glTF, ``file`` ends in .glb."""
        bones = animal_bones(animal_motion.animal, animal_motion.motion)
        with atomic_write(file) as part:
            write_skin(part, self.rig, bones, self.texture, animal_motion.animal.name)

    def film(
        self, animal_motion: SynthesisedAnimal, prepared: WalkRun, file: Path, marks: bool
    ) -> None:
        """Draw the film, ``file`` ends in .mp4; shows progress on standard error.

        Raises:
            InputError: the simulator or PyAV is not installed, or nothing draws here.

        """
        path = animal_motion.path
        dots = path.position(np.arange(0.0, path.length_m, 0.05))
        film_over(
            prepared,
            file,
            animal_bones(animal_motion.animal, animal_motion.motion),
            rig_look(self.rig, self.texture, spine=SEGMENTS),
            robot=as_long_robot(prepared.robot, _FRAMED_LENGTH * animal_motion.animal.length_m),
            reached_s=animal_motion.reached_s(),
            paths=[(0.0, dots)] if marks else None,
            fps=film_rate(animal_motion.animal.cycle_s),
        )


def film_rate(cycle_s: float) -> int:
    """Frames per second, a multiple of ``FPS`` that shows a cycle in at least ``_FRAMES``."""
    return FPS * int(np.ceil(_FRAMES / (FPS * cycle_s)))
