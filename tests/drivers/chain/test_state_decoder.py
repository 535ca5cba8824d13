"""Bytes of the state block to SI units, register by register."""

from collections.abc import Callable
from typing import Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from snakewalk.config.robot import JointConfig, RobotConfig
from snakewalk.drivers.chain import joint_codec
from snakewalk.drivers.chain.joint_codec import JointUnits, StateDecoder, decode_state
from snakewalk.drivers.protocol.control_table import load_control_table
from snakewalk.drivers.protocol.registers import ServoUnits

MODELS = ["XM430-W350", "XL330-M288"]
small = st.integers(-(2**15), 2**15 - 1)
large = st.integers(-(2**31), 2**31 - 1)


@pytest.mark.fast_cases(2)
@pytest.mark.parametrize(
    "loop", [decode_state, decode_state.py_func], ids=["compiled", "interpreted"]
)
@pytest.mark.parametrize("model", MODELS)
@given(
    sign=st.sampled_from([1, -1]),
    raw=st.lists(st.tuples(small, large, large), min_size=1, max_size=5),
)
def test_every_raw_value_is_scaled_by_its_unit(
    model: str, loop: Callable[..., None], sign: Literal[1, -1], raw: list[tuple[int, int, int]]
) -> None:
    table = load_control_table(model)
    units = ServoUnits.of(table.facts)
    blocks = [
        b"".join(v.to_bytes(n, "little", signed=True) for v, n in zip(each, (2, 4, 4), strict=True))
        for each in raw
    ]
    data = np.frombuffer(b"".join(blocks), np.uint8).reshape(-1, 10)
    current, velocity, position = (np.array(column) for column in zip(*raw, strict=True))
    found = np.zeros((3, len(raw)))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(joint_codec, "decode_state", loop)
        count = len(raw)
        robot = RobotConfig(
            name="some", joint_axes="y" * count, joints=(JointConfig(sign=sign),) * count
        )
        StateDecoder([table], JointUnits.of(robot, [units] * count)).decode(data, found)
    assert found[0].tolist() == (sign * units.current_a(current)).tolist()
    assert found[1].tolist() == (sign * units.velocity_rad_s(velocity)).tolist()
    assert found[2].tolist() == (sign * units.position_rad(position)).tolist()
    assert not np.signbit(found[found == 0.0]).any()
