"""A belly that slides nearly as well across as along: the walk takes bends that still push."""

import numpy as np

from snakewalk.controller.mechanics.traction import quasi_static_gain
from snakewalk.controller.run.factory import prepare_walk


def test_a_floor_with_little_hold_gets_wider_bends_and_the_user_is_told() -> None:
    usual = prepare_walk("flat-square", motion="walk", seed=3)
    slippery = prepare_walk("flat-square", motion="walk", seed=3, world="flat-friction-1.5")
    assert usual.library.curvature == 1.0
    assert usual.warnings == ()
    made = slippery.library
    assert made.curvature > 1.0
    least = slippery.run.states.gain_limit
    assert (quasi_static_gain(made.shapes_rad, slippery.world.friction) >= least).all()
    assert np.abs(made.shapes_rad).mean() > np.abs(usual.library.shapes_rad).mean()
    (line,) = slippery.warnings
    assert f"{made.curvature:g} times as wide" in line
