"""Choices that a file of tracks may need: options of commands, and answers in a file."""

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from snakewalk.config.answers import LISTED, Answers, TableAnswers
from snakewalk.config.errors import InputError

FEWEST = 4
"""Points for a curve."""
PLANES = {"xy": (0, 1), "xz": (0, 2), "yz": (1, 2)}
"""Planes onto which markers in space are projected: the axis to the right, and the one upwards.

A plane is seen from the positive end of the third axis, so that no body is mirrored: z points
downwards in ``xz``.
"""


class AnimalChoice(Answers):
    """Facts that a file of keypoints may not state, and the animal to use."""

    rate: float | None = Field(
        None,
        gt=0.0,
        description="frame rate in frames per second; default: the rate that the files state",
    )
    min_score: float | None = Field(
        None,
        ge=0.0,
        le=1.0,
        description="ignore keypoints with a lower score; default: 0, for DeepLabCut 0.6",
    )
    individual: str | None = Field(
        None, description="name of the animal to use from a file of several animals"
    )
    plane: Literal["xy", "xz", "yz"] | None = Field(
        None,
        description="plane of markers in space, seen from the positive end of the third axis; "
        "default: across the axis that points up",
    )


class Choice(AnimalChoice, TableAnswers):
    """Facts that a file of tracks may not state, and parts of it to use."""

    keypoints: Annotated[tuple[str, ...] | None, LISTED] = Field(
        None,
        description="A,B,C: names along the midline, head first; default: all, as listed",
    )
    time_unit: Literal["s", "ms", "us", "ns"] | None = Field(
        None, description="unit of times if a table states none"
    )

    def only(self, file: Path, kind: str, *allowed: str) -> None:
        """Reject options that do not apply to a kind of file.

        Raises:
            InputError: an option that is not ``allowed`` is given.

        """
        refusals = {"individual": "names no animals", "keypoints": "names no keypoints"}
        refusals |= {"plane": "is flat already", "time_unit": "needs no unit of time"}
        for name, reason in refusals.items():
            if getattr(self, name) is not None and name not in allowed:
                option = name.replace("_", "-")
                raise InputError(f"{file}: --{option}: {kind} {reason}; leave it out")

    def animal(self, file: Path, names: Sequence[str], present: Sequence[str]) -> str:
        """Name of the selected animal; ``present`` are those of ``names`` with any point.

        Raises:
            InputError: the name is unknown, or there are several animals and no choice.

        """
        listed = ", ".join(names)
        if self.individual is not None:
            if self.individual in names:
                return self.individual
            raise InputError(
                f"{file}: --individual {self.individual}: no such animal; in it are {listed}"
            )
        if len(present) > 1:
            raise InputError(
                f"{file}: {len(present)} animals in it ({', '.join(present)}): "
                "give --individual NAME"
            )
        if not present:
            raise InputError(f"{file}: 0 animals in it: no point of {listed or 'any'} was seen")
        return present[0]

    def order(self, file: Path, nodes: Sequence[str]) -> list[int]:
        """Indices of the keypoints along the midline.

        Raises:
            InputError: a name is unknown or repeated, or there are too few.

        """
        if self.keypoints is None:
            return list(range(len(nodes)))
        unknown = [name for name in self.keypoints if name not in nodes]
        if unknown:
            raise InputError(
                f"{file}: --keypoints: it has no {', '.join(unknown)}; it has {', '.join(nodes)}"
            )
        if len(set(self.keypoints)) < len(self.keypoints) or len(self.keypoints) < FEWEST:
            raise InputError(
                f"{file}: --keypoints: expected {FEWEST} or more names along the midline, head "
                f"first, each once; it has {', '.join(nodes)}"
            )
        return [list(nodes).index(name) for name in self.keypoints]


ALL = Choice()
"""Choice of nothing: one animal, all of its keypoints."""
