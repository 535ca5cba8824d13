"""Keys that waited while the run stood still move nothing."""

from typing import Any

from snakewalk.controller.motion.command import Refused
from snakewalk.controller.run.hands import Hands


class Device:
    """A keyboard, as far as ``Hands`` use it."""

    gone = None
    is_enabled = True

    def __init__(self) -> None:
        self.keys: list[str] = []

    def pressed(self) -> list[str]:
        keys, self.keys = self.keys, []
        return keys


def hands_at(now_s: list[float]) -> tuple[Hands, Device]:
    device: Any = Device()
    hands = Hands([device], None, lambda: now_s[0])
    assert hands.torque_off() is None
    return hands, device


def test_keys_of_a_run_that_stood_still_are_dropped_and_reported() -> None:
    now_s = [10.0]
    hands, device = hands_at(now_s)
    device.keys = ["n", "m"]
    now_s[0] = 10.9
    assert hands.torque_off() is None
    assert hands._take_keys() == ["n", "m"]
    device.keys = ["n", "q"]
    now_s[0] = 12.0
    assert hands.torque_off() is None
    late, ending = hands._take_keys()
    assert isinstance(late, Refused)
    assert late.why.startswith("n came up to 1.1 s late and is dropped; at most 1 s is accepted")
    assert ending == "q"


def test_keys_that_waited_for_the_motion_are_dropped() -> None:
    now_s = [10.0]
    hands, device = hands_at(now_s)
    device.keys = ["n"]
    for now_s[0] in (10.5, 11.0, 11.5):
        assert hands.torque_off() is None
    (late,) = hands._take_keys()
    assert isinstance(late, Refused)


def test_torque_off_is_never_too_late() -> None:
    now_s = [10.0]
    hands, device = hands_at(now_s)
    device.keys = ["t"]
    now_s[0] = 60.0
    assert hands.torque_off() == "the operator switched torque off"
