"""A policy of random weights, which reacts to all that it observes."""

import numpy as np

from snakewalk.config.loader import load_robot
from snakewalk.controller.motion.policy import (
    WAVE_SPAN,
    Layer,
    Origin,
    Policy,
    PolicyWave,
    observation_names,
)


def drawn_policy() -> Policy:
    rng = np.random.default_rng(0)
    names = observation_names(load_robot("yaw16"))
    shapes = [(8, len(names)), (len(WAVE_SPAN), 8)]
    network = [
        Layer(weights=rng.normal(0.0, 0.4, shape).tolist(), bias=[0.1] * shape[0])
        for shape in shapes
    ]
    return Policy(
        name="drawn",
        robot="yaw16",
        observation=names,
        origin=Origin(method="drawn", seed=0, steps=0, world="flat", software="none"),
        wave=PolicyWave(steering=(1.0, 0.5, 0.2), reflex=(0.1, 0.1, -0.1)),
        network=tuple(network),
    )
