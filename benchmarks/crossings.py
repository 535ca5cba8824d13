"""Identities of several animals through contact and crossing, on rendered films.

python -m benchmarks.crossings --seeds 20              # as a Markdown table
python -m benchmarks.crossings --only "3 fish" --seeds 3
"""

import argparse
import time
from dataclasses import dataclass, replace
from itertools import pairwise

import cv2
import numpy as np

from snakewalk.config.arrays import Floats, Image
from snakewalk.controller.capture.several.blobs import blobs_of, detector_of_several, usual_area
from snakewalk.controller.capture.several.identities import Identity, identities_of
from snakewalk.controller.capture.several.tracklets import TrackletBuilder
from tests.oracles.rendered_crossings import CrossingScene, crossing_film, crossing_midlines

_PLATE = CrossingScene(length_px=50.0, sizes=0.1, greys=10.0)
KINDS: dict[str, CrossingScene] = {
    "3 fish, sizes and greys differ": CrossingScene(
        sizes=0.25, slender=7.0, waves=0.8, bend_rad=0.5, speed=0.8
    ),
    "3 worms, sizes and greys differ": CrossingScene(),
    "3 worms that look the same": CrossingScene(sizes=0.0, greys=0.0),
    "10 worms on a plate": replace(_PLATE, animals=10, rows=420, columns=520, roam=0.38),
    "30 worms on a plate": replace(_PLATE, animals=30, rows=700, columns=860, roam=0.42, frames=90),
    "50 worms on a plate": replace(
        _PLATE, animals=50, rows=900, columns=1100, roam=0.43, frames=90
    ),
}
_SAMPLE = 25
_NEAR = 0.6  # body lengths between an animal and the blob that is taken for it


@dataclass(slots=True)
class Count:
    """Results of one or more films."""

    animals: int = 0
    found: int = 0
    """Identities that count as animals: ``Identity.is_animal``."""
    short: int = 0
    """Identities that are followed through less. Their contacts and frames count as well."""
    bridged: int = 0
    """Gaps between tracklets that were bridged."""
    kept: int = 0
    kept_uncertain: int = 0
    """Bridged rightly, yet reported as uncertain."""
    swapped_reported: int = 0
    swapped_silently: int = 0
    alone: int = 0
    """Frames of animals that are attributed to an identity."""
    frames: int = 0
    images: int = 0
    cpu_s: float = 0.0
    """CPU time of the identities, without drawing."""


def identities_in(images: list[Image]) -> list[Identity]:
    """Identities of a film."""
    some = images[:: max(1, len(images) // _SAMPLE)]
    detector = detector_of_several(some)
    sample = [blobs_of(one, detector) for one in some]
    usual = usual_area(sample)
    builder = TrackletBuilder(usual)
    for image in images:
        builder.add(blobs_of(image, detector, usual))
    return identities_of(builder.done())


def compare(identities: list[Identity], midlines: Floats, length_px: float) -> Count:
    """Compare identities with the true midlines (A, T, 101, 2)."""
    truth = midlines.mean(axis=2)
    count = Count(animals=len(truth), frames=truth.shape[0] * truth.shape[1])
    for one in identities:
        is_long = one.is_animal(truth.shape[1])
        count.found += is_long
        count.short += not is_long
        count.alone += one.frames
        names = []
        for tracklet in one.tracklets:
            at = np.array(tracklet.middles)
            apart = np.hypot(*(truth[:, tracklet.frames] - at).transpose(2, 0, 1))
            name = int(np.argmin(np.median(apart, axis=1)))
            names.append(name if np.median(apart[name]) < _NEAR * length_px else -1)
        for (old, new), (before, _) in zip(pairwise(names), pairwise(one.tracklets), strict=True):
            unsure = before.frames[-1] in one.uncertain_after
            count.bridged += 1
            count.kept += old == new
            count.kept_uncertain += old == new and unsure
            count.swapped_reported += old != new and unsure
            count.swapped_silently += old != new and not unsure
    return count


def measured(scene: CrossingScene, seeds: range) -> Count:
    """Sum over films."""
    total = Count()
    for seed in seeds:
        one = replace(scene, seed=seed)
        midlines = crossing_midlines(one)
        images = list(crossing_film(one, midlines))
        begin_s = time.process_time()
        identities = identities_in(images)
        spent_s = time.process_time() - begin_s
        count = compare(identities, midlines, one.length_px)
        count.images, count.cpu_s = len(images), spent_s
        for name in Count.__slots__:
            setattr(total, name, getattr(total, name) + getattr(count, name))
    return total


def main() -> None:
    """Measure what is asked for."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first", type=int, default=1000, help="first seed")
    parser.add_argument("--only", default="", help="part of a kind's name")
    given = parser.parse_args()
    cv2.setNumThreads(1)
    print(
        "| film | animals found | followed less than half | contacts bridged | kept "
        "| kept, but reported as uncertain | swapped, reported | swapped, not reported "
        "| frames attributed | CPU a frame |"
    )
    print("| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |")
    for name, scene in KINDS.items():
        if given.only in name:
            c = measured(scene, range(given.first, given.first + given.seeds))
            print(
                f"| {name} | {c.found} of {c.animals} | {c.short} | {c.bridged} | {c.kept} "
                f"| {c.kept_uncertain} | {c.swapped_reported} | {c.swapped_silently} "
                f"| {100.0 * c.alone / c.frames:.0f} % | {1e3 * c.cpu_s / c.images:.0f} ms |",
                flush=True,
            )


if __name__ == "__main__":
    main()
