"""A learnt policy as a file: a wave, and a small network that changes it during the run.

The wave is an oscillator with one phase for all joints. Without a network the wave stays, with two
feedbacks: bends against the heading's error, and reflexes to the joints' following errors. After G.
Bellegarda, A. Ijspeert, CPG-RL: Learning Central Pattern Generators for Quadruped Locomotion, IEEE
Robotics and Automation Letters 7 (4), 12547-12554, 2022: a network's actions are the oscillators'
parameters.
"""

import json
from pathlib import Path
from typing import Annotated, Self

import numpy as np
from pydantic import Field, model_validator

from snakewalk.config.arrays import Floats
from snakewalk.config.base import Name, Strict
from snakewalk.config.errors import InputError
from snakewalk.config.loader import load, locate
from snakewalk.config.robot import RobotConfig

_Amplitude = Annotated[float, Field(ge=0.0, le=0.8)]
_Waves = Annotated[float, Field(ge=0.2, le=3.0)]
_Gain = Annotated[float, Field(ge=-1.0, le=1.0)]
_Bend = Annotated[float, Field(ge=-3.0, le=3.0)]
DIGITS = 6
"""Significant digits of a number in a file."""


class PolicyWave(Strict):
    """A wave on the yaw joints; by default the lateral undulation of 16 joints, without feedback.

    Along the body values lie at knots, evenly from the head's tip to the tail's end, and are
    interpolated between them.
    """

    frequency_hz: float = Field(0.5, ge=0.1, le=2.0, description="cycles a second")
    amplitude_rad: tuple[_Amplitude, _Amplitude, _Amplitude, _Amplitude] = Field(
        (0.31, 0.31, 0.31, 0.31), description="amplitudes of the joints at four knots"
    )
    waves: tuple[_Waves, _Waves, _Waves] = Field(
        (1.2, 1.2, 1.2), description="a body length, on each third of the body"
    )
    third_harmonic: tuple[_Gain, _Gain] = Field(
        (0.0, 0.0), description="share of the amplitude, for its sine and its cosine"
    )
    steering: tuple[_Bend, _Bend, _Bend] = Field(
        (0.0, 0.0, 0.0),
        description="bend of the whole body against each radian of heading, at three knots",
    )
    reflex: tuple[_Gain, _Gain, _Gain] = Field(
        (0.0, 0.0, 0.0),
        description="radians for each radian by which the joint itself, the one before it and the "
        "one behind it are off their goals",
    )

    def vector(self) -> Floats:
        """(P,) all values, in the order of the fields."""
        return np.hstack([np.atleast_1d(value) for value in self.model_dump().values()])

    @classmethod
    def of(cls, values: Floats) -> Self:
        """Return the wave of values (P,), clipped to their ranges and rounded as in a file."""
        clipped = np.clip(values, *WAVE_ENDS)
        start = 0
        fields = {}
        for key, value in cls().model_dump().items():
            size = np.size(value)
            part = [_rounded_value(part_value) for part_value in clipped[start : start + size]]
            fields[key] = part if isinstance(value, tuple) else part[0]
            start += size
        return cls.model_validate(fields)


WAVE_ENDS: tuple[Floats, Floats] = (
    np.repeat([0.1, 0.0, 0.2, -1.0, -3.0, -1.0], [1, 4, 3, 2, 3, 3]),
    np.repeat([2.0, 0.8, 3.0, 1.0, 3.0, 1.0], [1, 4, 3, 2, 3, 3]),
)
"""(P,) least and greatest values of a wave."""
WAVE_SPAN: Floats = np.repeat([0.5, 0.15, 0.4, 0.2, 1.0, 0.3], [1, 4, 3, 2, 3, 3])
"""(P,) what an action of 1 changes; the step of a search begins with a share of it (ours)."""


class Layer(Strict):
    """Outputs are ``tanh(weights @ inputs + bias)``; the last layer's are without the tanh."""

    weights: tuple[tuple[float, ...], ...] = Field(
        description="weights of the network, one row for each output"
    )
    """(outputs, inputs) weights of the layer."""
    bias: tuple[float, ...] = Field(description="biases, one for each output")
    """(outputs,) biases of the layer."""


class Origin(Strict):
    """How a policy was learnt."""

    method: str = Field(description="the optimiser: cma or ppo")
    seed: int = Field(description="seed of every random choice")
    steps: int = Field(ge=0, description="total number of environment steps")
    world: str = Field(description="world of the training")
    law: str = Field("", description="law of friction of that world; empty: not stated")
    software: str = Field(description="names and versions")


class Policy(Strict):
    """A policy's file."""

    name: Name
    robot: str = Field(description="robot of the training; others need as many yaw joints")
    observation: tuple[str, ...] = Field((), description="names of the network's inputs")
    origin: Origin
    wave: PolicyWave = PolicyWave()
    network: tuple[Layer, ...] = Field(
        (), description="network that changes the wave; default: the wave stays the same"
    )

    @model_validator(mode="after")
    def _layers_fit(self) -> Self:
        if bool(self.network) != bool(self.observation):
            raise ValueError("a network has an observation, and an observation a network")
        inputs = len(self.observation)
        for number, layer in enumerate(self.network, 1):
            if any(len(row) != inputs for row in layer.weights):
                raise ValueError(f"network: layer {number}: each row of weights has {inputs}")
            if len(layer.weights) != len(layer.bias):
                raise ValueError(f"network: layer {number}: as many rows of weights as biases")
            inputs = len(layer.bias)
        if self.network and inputs != len(WAVE_SPAN):
            raise ValueError(f"network: the last layer has {len(WAVE_SPAN)} outputs")
        return self

    def check(self, robot: RobotConfig) -> None:
        """Reject a robot whose joints differ from those that the network observes.

        Raises:
            InputError: the joints differ.

        """
        if self.network and self.observation != observation_names(robot):
            raise InputError(
                f"policy {self.name}: its network observes the joints of {self.robot}; "
                f"robot {robot.name} has others"
            )

    def toml(self) -> str:
        """The file as TOML, numbers with six digits."""
        data = self.model_dump()
        tables = {key: data.pop(key) for key in ("origin", "wave", "network")}
        lines = [f"{key} = {json.dumps(value)}" for key, value in data.items()]
        for key in ("origin", "wave"):
            lines += ["", f"[{key}]"]
            lines += [f"{name} = {json.dumps(value)}" for name, value in tables[key].items()]
        for layer in tables["network"]:
            rows = ",\n  ".join(
                json.dumps([_rounded_value(v) for v in row]) for row in layer["weights"]
            )
            bias = json.dumps([_rounded_value(value) for value in layer["bias"]])
            lines += ["", "[[network]]", f"bias = {bias}", f"weights = [\n  {rows},\n]"]
        return "\n".join(lines) + "\n"


def load_policy(name_or_path: str) -> Policy:
    """Load a policy by shipped name or path.

    Raises:
        ConfigError: no such policy; each fault of the file.

    """
    return load(locate("policies", name_or_path), Policy)


def save_policy(policy: Policy, path: Path) -> None:
    """Write a policy file."""
    path.write_text(policy.toml(), encoding="utf-8")


def observation_names(robot: RobotConfig) -> tuple[str, ...]:
    """Name, with unit, of each number that a network observes on a robot."""
    kinds = ("measured", "goal")
    joints = [f"{of}_joint{k}_rad" for of in kinds for k in robot.yaw_joints]
    return ("phase_cos", "phase_sin", "heading_cos", "heading_sin", *joints)


def _rounded_value(value: float) -> float:
    return float(f"{float(value):.{DIGITS}g}")
