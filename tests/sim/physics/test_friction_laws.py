"""Each law of friction in the plant against the planar model that has it from its publication.

The model follows the joint angles that the plant measured, not the commanded ones.
"""

from dataclasses import dataclass

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from snakewalk.config.friction_law import LawName
from snakewalk.controller.kinematics.smoothstep import quintic
from snakewalk.sim.physics.body import belly_points_m
from tests.helpers.physics import HZ, ROBOT, Floats, a_body, a_drive
from tests.oracles.planar_reference import PlanarBody, simulate

STEP_S = 0.001
SECONDS = 1.0 + 1.0 / HZ
MU = {"rough": (0.1, 0.7), "milk snake": (0.11, 0.2, 0.14)}
"""Along, across, and back."""


@dataclass(frozen=True)
class Wave:
    """Joint angles of a wave that grows from a straight body within 1 s."""

    amplitude_rad: float
    waves: float
    hz: float = HZ

    def at(self, time_s: float) -> Floats:
        grown = self.amplitude_rad * quintic(min(max(time_s, 0.0), 1.0))
        place = np.arange(ROBOT.joint_count) / ROBOT.joint_count
        return np.asarray(grown * np.sin(2.0 * np.pi * (self.hz * time_s - self.waves * place)))


GAITS = {"long": Wave(0.35, 1.1), "short": Wave(0.45, 2.0), "backward": Wave(0.35, 1.5, -HZ)}


def way_m(law: LawName, mu: tuple[float, ...], wave: Wave, step_s: float) -> tuple[Floats, Floats]:
    """Displacement (2,) of the centre in a cycle: in the plant, and in the planar model."""
    body, drive = a_body(mu, step_s, law=law), a_drive()
    steps = round(SECONDS / step_s)
    joints = np.zeros((steps + 1, ROBOT.joint_count))
    centre = np.zeros((steps + 1, 2))
    centre[0] = body.link_positions_m[:, :2].mean(axis=0)
    for k in range(1, steps + 1):
        drive.goal_rad[:] = wave.at((k - 1) * step_s)
        body.advance(k * step_s, drive)
        joints[k] = body.position_rad
        centre[k] = body.link_positions_m[:, :2].mean(axis=0)
    m, r, length = ROBOT.mean_link_mass_kg, ROBOT.body_radius_m, ROBOT.mean_link_length_m
    planar = PlanarBody(
        links=ROBOT.joint_count + 1,
        link_m=length,
        mass_kg=m,
        spin_kg_m2=m * (3 * r**2 + length**2) / 12,
        mu_along=mu[0],
        mu_across=mu[1],
        points_m=tuple(belly_points_m(ROBOT, 1)[0, :, 0]),
        mu_back=mu[2] if len(mu) > 2 else None,
        law=law,
    )
    still = np.zeros(ROBOT.joint_count)
    time_s = np.arange(steps + 1) * step_s
    shape = CubicSpline(time_s, joints, bc_type=((1, still), "not-a-knot"))
    rate = shape.derivative()
    marks_s = np.array([0.0, 1.0, SECONDS])
    expected = simulate(planar, lambda t: (shape(t), rate(t)), marks_s).centre_m
    return centre[-1] - centre[round(1.0 / step_s)], expected[2] - expected[1]


@pytest.mark.costs("simulates a body for three seconds, and a planar model of it")
def test_speed_under_scales_is_that_of_the_publication() -> None:
    """The fast case: a milk snake's coefficients, of which the one backward is another."""
    made, expected = way_m("scales", MU["milk snake"], GAITS["long"], 0.002)
    print(f"{made[0] / expected[0] - 1.0:+.2%} of {expected[0]:.4f} m")
    assert made[0] == pytest.approx(expected[0], rel=0.01)


@pytest.mark.slow_cases(1, "three seconds of a planar model each: 2 s of CPU")
@pytest.mark.slow
@pytest.mark.parametrize("law", ["scales", "wheels", "ellipse"])
@pytest.mark.parametrize("mu", MU)
@pytest.mark.parametrize("gait", GAITS)
def test_speed_is_that_of_the_publication(law: LawName, mu: str, gait: str) -> None:
    """Within 1 %, three gaits, two ratios; or within 1.5 mm of a cycle.

    The latter is the creep of wheels near rest, where the long wave travels only 3 cm a cycle.
    """
    made, expected = way_m(law, MU[mu], GAITS[gait], STEP_S)
    print(f"{law} {mu} {gait}: {made[0] / expected[0] - 1.0:+.2%} of {expected[0]:.4f} m")
    assert made[0] == pytest.approx(expected[0], rel=0.01, abs=0.0015)
