"""Recorded actions one after the other."""

from collections.abc import Sequence

import numpy as np

from snakewalk.controller.kinematics.frame import Frame
from snakewalk.controller.repertoire.replay import Replayed, bridge, replay
from snakewalk.controller.repertoire.segment import Segment


def replay_all(
    segments: Sequence[Segment], start: Frame, scale: float = 1.0, largest_tip_m: float = 0.02
) -> Replayed:
    """Play segments one after the other, with bridges in which the body frame stays.

    ``largest_tip_m``: distance of the tail, in the body frame of the recorded size, in a frame.
    """
    parts: list[Replayed] = []
    at = start
    for k, segment in enumerate(segments):
        if k:
            shapes = scale * bridge(segments[k - 1].link_m[-1], segment.link_m[0], largest_tip_m)
            count = len(shapes)
            if count:
                still = np.repeat(at.rotation[None], count, axis=0)
                stays = np.repeat(at.origin_m[None], count, axis=0)
                parts.append(Replayed(still, stays, at.to_world_m(shapes)))
        parts.append(replay(segment, at, scale))
        at = parts[-1].end
    return Replayed(
        *(
            np.concatenate([getattr(part, name) for part in parts])
            for name in ("rotation", "origin_m", "link_m")
        )
    )
