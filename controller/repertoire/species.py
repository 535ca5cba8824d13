"""Species of a crowd: bodies with one repertoire and one habit ([YT] 5)."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from snakewalk.config.arrays import Floats
from snakewalk.controller.repertoire.habit import Habit
from snakewalk.controller.repertoire.repertoire import Repertoire


@dataclass(frozen=True, slots=True)
class Species:
    """Bodies of one repertoire."""

    repertoire: Repertoire
    sizes: Floats
    """(n,) lengths of the bodies over the recorded length."""
    radius_m: Floats
    """(L,) half the widths of the recorded body at its links."""
    habit: Habit = Habit.WANDER


def joined(species: Sequence[Species]) -> tuple[Repertoire, list[Floats]]:
    """Return the segments of all species in one repertoire, and the radii of each species.

    Bodies with fewer links have points between them, so that all have equally many.
    """
    most = max(len(kind.radius_m) for kind in species)
    segments = []
    radii = []
    for kind in species:
        links = len(kind.radius_m)
        places = np.linspace(0.0, links - 1.0, most)
        weights = np.array([np.interp(places, np.arange(links), row) for row in np.eye(links)]).T
        segments += [
            replace(segment, link_m=weights @ segment.link_m)
            for segment in kind.repertoire.segments
        ]
        radii.append(weights @ kind.radius_m)
    return replace(species[0].repertoire, segments=tuple(segments)), radii
