"""Page of ``pose check``: the measured body on its ground, and facts of the feed."""

from typing import Any

import numpy as np

from snakewalk.config.pose import PoseConfig
from snakewalk.controller.kinematics.links import body_in_world
from snakewalk.controller.pose.sample import PoseSample
from snakewalk.controller.pose.tracked_body import TrackedBody
from snakewalk.controller.run.prepared_run import PreparedRun
from snakewalk.controller.runlog.evidence import Kind, PoseEvidence
from snakewalk.controller.runlog.record import POSE_CHECK, Header
from snakewalk.controller.runlog.topics import PoseTable
from snakewalk.controller.runlog.writer import RunLog
from snakewalk.drivers.types import BodyPose, JointState

FACTS = (
    ("rate_hz", "rate {} Hz"),
    ("jitter_mean_s", "delay beyond the quickest {} s"),
    ("longest_gap_s", "longest gap {} s"),
    ("noise_m", "noise {} m"),
    ("noise_deg", "noise {} deg"),
    ("frame", "frame {}"),
)
"""Facts of the feed with their words."""


def feed_words(facts: dict[str, Any]) -> list[str]:
    """Return the known facts of a feed in words."""
    return [text.format(facts[key]) for key, text in FACTS if facts.get(key) is not None]


class PoseCheckPage:
    """Shows poses in a page that accepts rows of a log.

    Joint angles are unknown before torque, so the body is straight.
    """

    def __init__(self, log: RunLog, prepared: PreparedRun, config: PoseConfig, source: str) -> None:
        """Show the poses of ``source`` in the page behind ``log``."""
        self._log = log
        self._config = config
        self._robot = prepared.robot
        self._tracked = TrackedBody(prepared.robot, config)
        self._straight = np.zeros(prepared.robot.joint_count)
        log.config(
            Header(
                prepared.run,
                prepared.robot,
                prepared.world,
                backend=POSE_CHECK,
                plan=prepared.check_plan(),
                ground=prepared.ground,
                pose_evidence=PoseEvidence(
                    Kind.MEASURED, source, config.noise_m, float(np.radians(config.noise_deg))
                ),
            )
        )

    def show(self, time_s: float, sample: PoseSample) -> None:
        """Draw the body at a pose."""
        straight = self._straight
        count = len(self._straight)
        unknown = np.full(count, np.nan)
        zero_bytes = np.zeros(count, np.uint8)
        state = JointState(
            time_s,
            unknown,
            unknown,
            unknown,
            unknown,
            unknown,
            zero_bytes,
            zero_bytes,
            unknown,
            zero_bytes == 1,
            unknown,
        )
        self._log.cycle(
            time_s,
            unknown,
            unknown,
            state,
            deadline_s=time_s,
            lateness_s=0.0,
            wire_busy_s=float("nan"),
            electrical_j=float("nan"),
            mechanical_j=float("nan"),
            yield_rad=None,
            verdict="pass",
            reason="",
            joints=[],
        )
        head = self._tracked.head(sample, straight)
        view = body_in_world(
            self._robot, BodyPose(time_s, head.position_m, head.rotation), straight
        )
        self._log.add(
            PoseTable,
            time_s,
            head_m=head.position_m,
            rotation=head.rotation,
            links_m=view.link_m,
            centre_m=view.centre_m,
            speed_m_s=float("nan"),
            predicted_speed_m_s=float("nan"),
            pulse_m_s=float("nan"),
            path_s_m=float("nan"),
        )

    def report(self, time_s: float, facts: dict[str, Any], faults: list[str]) -> None:
        """Show the facts of the feed, and its faults, as events."""
        words = feed_words(facts)
        offset = ", ".join(f"{value:g}" for value in self._config.offset_m)
        words.append(f"mount: link {self._config.link}, offset {offset} m")
        self._log.event(time_s, "pose", "; ".join(words))
        for fault in faults:
            self._log.event(time_s, "pose fault", fault, "warning")
