"""Bytes of the state block to SI units, register by register."""

from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from snakewalk.drivers.chain import joint_codec
from snakewalk.drivers.chain.joint_codec import StateDecoder, decode_state
from snakewalk.drivers.protocol.control_table import load_control_table
from snakewalk.drivers.protocol.registers import ServoUnits

MODELS = ["XM430-W350", "XL330-M288"]
small = st.integers(-(2**15), 2**15 - 1)
large = st.integers(-(2**31), 2**31 - 1)


@pytest.mark.parametrize(
    "loop", [decode_state, decode_state.py_func], ids=["compiled", "interpreted"]
)
@pytest.mark.parametrize("model", MODELS)
@settings(deadline=None)  # interpreted loops are slow
@given(raw=st.lists(st.tuples(small, large, large), min_size=1, max_size=5))
def test_every_raw_value_is_scaled_by_its_unit(
    model: str, loop: Callable[..., None], raw: list[tuple[int, int, int]]
) -> None:
    table = load_control_table(model)
    units = ServoUnits.of(table)
    blocks = [
        b"".join(v.to_bytes(n, "little", signed=True) for v, n in zip(each, (2, 4, 4), strict=True))
        for each in raw
    ]
    data = np.frombuffer(b"".join(blocks), np.uint8).reshape(-1, 10)
    current, velocity, position = (np.array(column) for column in zip(*raw, strict=True))
    found = np.zeros((3, len(raw)))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(joint_codec, "decode_state", loop)
        StateDecoder(table, units).decode(data, found)
    assert found[0].tolist() == units.current_a(current).tolist()
    assert found[1].tolist() == units.velocity_rad_s(velocity).tolist()
    assert found[2].tolist() == units.position_rad(position).tolist()
