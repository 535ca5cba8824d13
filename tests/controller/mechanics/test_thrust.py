"""Forward speed of joint motions by the traction model."""

import numpy as np
import pytest

from snakewalk.config.arrays import Floats
from snakewalk.config.loader import load_robot
from snakewalk.config.world import FrictionConfig
from snakewalk.controller.mechanics.thrust import forward_speed_m_s

TIME_S = np.linspace(0.0, 5.0, 151)
PLACE = 2.0 * np.pi * np.arange(16) / 10.0
PHASE = 2.0 * np.pi * 0.4 * TIME_S[:, None]


def speed_m_s(joints: Floats) -> float:
    return forward_speed_m_s(load_robot("yaw16"), FrictionConfig(), TIME_S, joints)


def test_a_wave_to_the_tail_carries_the_body_forward_and_one_to_the_head_backward() -> None:
    ahead = speed_m_s(0.4 * np.sin(PLACE - PHASE))
    pulse_m_s = load_robot("yaw16").length_m * 10.0 / 17.0 * 0.4
    assert 0.6 * pulse_m_s < ahead < pulse_m_s
    assert speed_m_s(0.4 * np.sin(PLACE + PHASE)) == pytest.approx(-ahead, rel=0.05)


def test_a_standing_wave_and_a_still_body_do_not_move() -> None:
    assert abs(speed_m_s(0.4 * np.sin(PLACE) * np.sin(PHASE))) < 0.005
    assert speed_m_s(np.full((151, 16), 0.2)) == 0.0
