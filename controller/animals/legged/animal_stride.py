"""A tracked animal with legs, from a file of named keypoints to a file of its own."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from snakewalk.config.animal import AnimalConfig
from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError
from snakewalk.config.template import template
from snakewalk.controller.animals.legged.animal_synthesis import read_animal
from snakewalk.controller.animals.legged.prototype import LEGS
from snakewalk.controller.animals.legged.stride import Foot, Stride, measure_stride
from snakewalk.controller.animals.legged.views import View
from snakewalk.controller.console.rounding import rounded
from snakewalk.controller.track.readers.keypoints import KEYPOINT_RATE_HZ, Keypoints

_FEWEST_POINTS = 3
_HEAD = """An animal by the stride of a tracked one; height, knees and skin are those of {like}.
  snakewalk animal synthesise jacksboro-traverse --animal {name}.toml --film
A line behind # shows a key with its default."""


@dataclass(frozen=True, slots=True)
class Names:
    """Keypoints of the spine, the girdles and the feet."""

    spine: tuple[str, ...]
    """Names of the keypoints of the spine, head first."""
    girdles: tuple[str, ...]
    """Names of the keypoints of the spine at the front and the hind legs."""
    feet: tuple[str, ...]
    """Names of the keypoints of the feet, in the order of ``LEGS``."""

    @classmethod
    def of(cls, spine: str, girdles: str, feet: str) -> "Names":
        """Parse the words of the command line, A,B,C each.

        Raises:
            InputError: too few names, or girdles that are not points of the spine.

        """
        parts = [tuple(part.strip() for part in text.split(",")) for text in (spine, girdles, feet)]
        names = cls(*parts)
        if len(names.spine) < _FEWEST_POINTS or len(set(names.spine)) < len(names.spine):
            raise InputError(
                f"--spine {spine}: expected three names or more, head first, each once"
            )
        if len(names.girdles) != 2 or not set(names.girdles) <= set(names.spine):
            raise InputError(f"--girdles {girdles}: expected two names of the spine: front,hind")
        if names.spine.index(names.girdles[0]) >= names.spine.index(names.girdles[1]):
            raise InputError(f"--girdles {girdles}: the front one comes first")
        if len(names.feet) != len(LEGS) or len({*names.feet, *names.spine}) < 4 + len(names.spine):
            raise InputError(f"--feet {feet}: expected four other names: {', '.join(LEGS)}")
        return names


@dataclass(frozen=True, slots=True)
class MeasuredAnimal:
    """A stride, and the animal that moves by it."""

    stride: Stride
    animal: AnimalConfig
    like: str
    rate_hz: float
    rate_assumed: bool

    def text(self) -> str:
        """Its file."""
        head = _HEAD.format(like=self.like, name=self.animal.name)
        return template(self.animal, head)

    def facts(self) -> dict[str, object]:
        """Plain numbers, for the table and JSON."""
        measured_stride = self.stride
        animal = self.animal
        return {
            "rate_hz": self.rate_hz,
            "rate_assumed": self.rate_assumed,
            "cycles": round(measured_stride.cycles, 2),
            "cycle_s": round(measured_stride.cycle_s, 4),
            "stride_body_lengths": round(measured_stride.stride, 4),
            "speed_m_s": round(animal.speed_m_s, 4),
            "duty": {leg: round(foot.duty, 3) for leg, foot in self._feet()},
            "duty_sd": {leg: rounded(foot.duty_sd, 3) for leg, foot in self._feet()},
            "comes_down_cycles": {leg: round(foot.down, 3) for leg, foot in self._feet()},
            "fit_rms_body_lengths": {leg: round(foot.residual, 4) for leg, foot in self._feet()},
            "girdle_turn_rad": [rounded(turn, 3) for turn in measured_stride.turn_rad],
            "lift_body_lengths": [rounded(lift, 3) for lift in measured_stride.lift],
        }

    def _feet(self) -> "zip[tuple[str, Foot]]":
        return zip(LEGS, self.stride.feet, strict=True)


def measure_animal(
    keypoints: Keypoints,
    names: Names,
    like: str,
    name: str,
    length_m: float | None,
    view: View,
) -> MeasuredAnimal:
    """Measure the stride of a tracked animal.

    Args:
        keypoints: of one animal.
        names: roles of the keypoints.
        like: animal that gives the other figures.
        name: of the new animal.
        length_m: of the spine; None: by the file's scale, else that of ``like``.
        view: above or side.

    Raises:
        InputError: no such keypoint, or no stride can be measured.

    """
    other = read_animal(like)
    if length_m is not None and not (np.isfinite(length_m) and length_m > 0.0):
        raise InputError(f"--length-m {length_m:g}: must be a positive number of metres")
    order = [_index(keypoints, keypoint) for keypoint in (*names.spine, *names.feet)]
    places = _places_of_all_frames(keypoints, keypoints.sure(order))
    rate_hz = KEYPOINT_RATE_HZ if keypoints.rate_hz is None else keypoints.rate_hz
    girdles = names.spine.index(names.girdles[0]), names.spine.index(names.girdles[1])
    count = len(names.spine)
    try:
        stride = measure_stride(places[:, :count], places[:, count:], girdles, rate_hz, view)
    except InputError as error:
        raise InputError(f"{keypoints.file}: {error}") from None
    if length_m is None:
        scale_m = keypoints.scale_m
        length_m = other.length_m if scale_m is None else scale_m * stride.length
    source = f"stride: {keypoints.file.name}, {stride.cycles:.1f} cycles; the rest: {other.source}"
    animal = stride.of(other, name, source, length_m)
    return MeasuredAnimal(stride, animal, like, rate_hz, keypoints.rate_hz is None)


def _index(keypoints: Keypoints, name: str) -> int:
    nodes: Sequence[str] = keypoints.nodes
    if name not in nodes:
        raise InputError(f"{keypoints.file}: it has no {name}; it has {', '.join(nodes)}")
    return list(nodes).index(name)


def _places_of_all_frames(keypoints: Keypoints, places: Floats) -> Floats:
    """Places of every frame from the first to the last, NaN where the file has none."""
    if keypoints.frame is None:
        return places
    index = keypoints.frame - keypoints.frame[0]
    even_places = np.full((int(index[-1]) + 1, *places.shape[1:]), np.nan)
    even_places[index] = places
    return even_places
