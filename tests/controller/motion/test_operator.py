"""A live operator: keys from a terminal or a gamepad change what runs, and nothing steps."""

import errno
import os
import pty
import struct
from pathlib import Path

import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_robot
from snakewalk.controller.gaits.registry import make_gait
from snakewalk.controller.kinematics.links import BodyView
from snakewalk.controller.motion.gait_motion import GaitMotion
from snakewalk.controller.motion.operator import Operator
from snakewalk.controller.run.hands import Gamepad, Keyboard, Pad, names

VIEW = BodyView(np.zeros((17, 3)), np.zeros((17, 3, 3)), np.zeros(3))


class Hands:
    def __init__(self, robot: str = "alternating16", gait: str = "sidewinding") -> None:
        self.robot = load_robot(robot)
        self.waiting: list[str] = []
        self.said: list[str] = []
        self.operator = Operator(
            GaitMotion(make_gait(gait), self.robot), self.robot, self._take, self._hear
        )
        self.seen = [self.operator.goal_rad()]

    def _take(self) -> list[str]:
        taken, self.waiting = self.waiting, []
        return taken

    def _hear(self, kind: str, text: str) -> None:
        assert kind == "operator"
        self.said.append(text)

    def press(self, *keys: str, seconds: float = 0.3) -> None:
        self.waiting = list(keys)
        for _ in range(int(seconds / 0.02)):
            self.seen.append(self.operator.step(0.02, VIEW))


def test_a_value_is_put_within_its_range_and_what_is_none_is_refused() -> None:
    hands = Hands()
    hands.press("winding_rad=0.5", "waves=99", "mirror=1")
    params = hands.operator.motion.gait.params
    assert (params.winding_rad, params.waves, params.mirror) == (0.5, 3.0, True)
    assert hands.said[1:3] == ["waves = 99 is outside 0.75 to 3", "waves = 3.0"]
    for wrong in ("winding_rad=nan", "winding_rad=", "nothing=1", "gait=nothing", "=", "="):
        hands.press(wrong, seconds=0.02)
        assert hands.said[-1].startswith("refused"), wrong
    assert hands.operator.motion.gait.params == params
    hands.press("gait=rolling", seconds=2.0)
    assert hands.operator.motion.gait.name == "rolling"
    speeds = np.abs(np.diff(hands.seen, axis=0)).max() / 0.02
    assert speeds <= hands.robot.joint_speed_limit_rad_s + 1e-6


def test_what_the_joints_leave_of_a_frequency_is_told_for_every_gait_and_change() -> None:
    told: list[str] = []
    robot = load_robot("yaw16")
    motion = GaitMotion(make_gait("lateral-undulation"), robot, on_limit=told.append)
    assert (told, motion.limit) == ([], None)
    motion.change(frequency_hz=2.0)
    assert motion.frequency_hz < 1.9
    assert (
        told == [motion.limit] == [f"2 Hz is too fast for the joints: {motion.frequency_hz:.2f} Hz"]
    )
    motion.change(frequency_hz=0.3)
    assert (len(told), motion.limit) == (1, None)
    GaitMotion(
        motion.gait.of(motion.gait.params.model_dump() | {"frequency_hz": 2.0}),
        robot,
        on_limit=told.append,
    )
    assert told[1] == told[0]


def test_arrows_choose_a_parameter_and_change_it_within_its_range() -> None:
    hands = Hands()
    assert hands.operator.selected == "frequency_hz"
    hands.press("right")
    assert hands.operator.motion.gait.params.frequency_hz == pytest.approx(0.55)
    hands.press("down", "down", "left")
    assert hands.operator.selected == "winding_rad"
    assert hands.operator.motion.gait.params.winding_rad == pytest.approx(0.7 - 1.4 / 40)
    hands.press(*["left"] * 60)
    assert hands.operator.motion.gait.params.winding_rad == 0.0
    assert hands.said[-1] == "winding_rad = 0.0"


def test_other_gaits_mirror_defaults_halt_and_stop() -> None:
    hands = Hands()
    hands.press("m")
    assert hands.operator.motion.gait.params.mirror
    hands.press("n")
    assert hands.operator.motion.gait.name == "rolling"
    hands.press("p")
    assert hands.operator.motion.gait.name == "sidewinding"
    hands.press("right", "d")
    assert hands.operator.motion.gait.params == make_gait("sidewinding").params
    hands.press("space", seconds=1.0)
    np.testing.assert_array_equal(hands.seen[-1], hands.seen[-2])
    hands.press("space", seconds=1.0)
    assert np.abs(hands.seen[-1] - hands.seen[-2]).max() > 1e-3
    hands.press("q", seconds=1.5)
    assert hands.operator.done
    assert "halt" in hands.said
    assert hands.said[-1] == "stop"


def test_another_gait_reports_which_directions_it_does_not_keep() -> None:
    hands = Hands("yaw16", "lateral-undulation")
    hands.press("backward=1", "turn_rad=0.5", "gait=concertina", seconds=0.02)
    assert hands.said[-2:] == [
        "gait concertina",
        "gait concertina does not keep backward, turn_rad",
    ]
    hands.press("gait=lateral-undulation", seconds=0.02)
    assert hands.said[-1] == "gait lateral-undulation"
    hands.press("m", "d", seconds=0.02)
    assert hands.said[-1] == "gait lateral-undulation does not keep mirror"


def test_on_a_yaw_robot_only_gaits_of_yaw_come_round() -> None:
    hands = Hands("yaw16", "lateral-undulation")
    seen = set()
    for _ in range(8):
        hands.press("n")
        assert not hands.operator.motion.gait.needs.pitch
        seen.add(hands.operator.motion.gait.name)
    assert {"lateral-undulation", "concertina"} <= seen


def test_what_the_joints_cannot_do_is_refused_and_told() -> None:
    hands = Hands("alternating16", "concertina")
    while hands.operator.selected != "folds":
        hands.press("down")
    hands.press(*["right"] * 40, seconds=1.0)
    assert any(said.startswith("refused: gait concertina: joint") for said in hands.said)
    hands.operator.motion.gait.check(hands.robot)


def test_hammering_on_the_keys_makes_no_step() -> None:
    hands = Hands()
    rng = np.random.default_rng(3)
    keys = ["up", "down", "left", "right", "n", "p", "m", "d", "space", "?"]
    for _ in range(150):
        hands.press(*rng.choice(keys, size=3), seconds=0.1)
    speed = np.diff(hands.seen, axis=0) / 0.02
    acceleration = np.diff(speed, axis=0) / 0.02
    assert np.abs(speed).max() < 1.06 * hands.robot.joint_speed_limit_rad_s
    assert np.abs(acceleration).max() < 1.06 * hands.robot.joint_acceleration_limit_rad_s2


def test_a_terminals_characters_become_names() -> None:
    assert names("\x1b[A\x1b[Bn \x1b[Cq\x1bOD") == [
        "up", "down", "n", "space", "right", "q", "left",
    ]  # fmt: skip
    assert names("\x1b") == []


def test_keys_come_from_a_terminal_at_once_and_it_is_restored() -> None:
    ours, theirs = pty.openpty()
    import termios

    before = termios.tcgetattr(theirs)
    with Keyboard(theirs) as keyboard:
        assert keyboard.pressed() == []
        os.write(ours, b"\x1b[Am")
        assert keyboard.pressed() == ["up", "m"]
    assert termios.tcgetattr(theirs) == before
    os.close(ours)
    os.close(theirs)


def test_a_pipe_is_no_keyboard(tmp_path: Path) -> None:
    with (tmp_path / "keys").open("w+") as file, pytest.raises(InputError, match="a terminal"):
        Keyboard(file.fileno())


def event(value: int, kind: int, number: int) -> bytes:
    return struct.pack("<IhBB", 0, value, kind, number)


def test_a_gamepads_events_become_names_once_a_push() -> None:
    pad = Pad()
    start = event(0, 0x81, 0) + event(32767, 0x82, 1)
    assert pad.keys(start) == [], "the state at the start is no push"
    pushed = event(-32767, 2, 0) + event(-30000, 2, 0) + event(0, 2, 0) + event(32767, 2, 0)
    data = pushed + event(1, 1, 0) + event(0, 1, 0) + event(1, 1, 7)
    assert pad.keys(data[:11]) + pad.keys(data[11:]) == ["left", "right", "n", "q"]


def test_a_gamepad_is_read_without_waiting_and_a_missing_one_refused(tmp_path: Path) -> None:
    fifo = tmp_path / "js0"
    os.mkfifo(fifo)
    with Gamepad(fifo) as pad:
        assert pad.pressed() == []
        with fifo.open("wb", buffering=0) as file:
            file.write(event(1, 1, 1))
            assert pad.pressed() == ["m"]
    with pytest.raises(InputError, match="no gamepad"):
        Gamepad(tmp_path / "none")


def test_a_body_moves_only_while_the_dead_mans_button_is_held() -> None:
    hands, held = Hands(), [False]
    robot, motion = hands.robot, hands.operator.motion
    hands.operator = Operator(motion, robot, hands._take, hands._hear, lambda: held[0])
    hands.press(seconds=1.0)
    still = hands.seen[-1]
    hands.press("q", seconds=1.0)
    assert np.array_equal(hands.seen[-1], still), "nothing moves it but the button"
    assert hands.said == ["button released: the body holds its shape", "stop"]
    held[0] = True
    hands.press(seconds=0.3)
    assert np.abs(hands.seen[-1] - still).max() > 1e-3
    held[0] = False
    hands.press(seconds=1.0)
    assert not hands.operator.done
    assert np.array_equal(hands.seen[-1], hands.seen[-20])
    steps = np.abs(np.diff(hands.seen, axis=0)).max()
    assert steps < 0.02 * robot.joint_speed_limit_rad_s, "letting go makes no step"


def test_a_pad_tells_whether_a_shoulder_is_held_and_one_that_is_gone_holds_none(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pad = Pad()
    assert not pad.is_enabled
    assert pad.keys(event(1, 0x81, 4)) == [], "held when the device was opened"
    assert pad.is_enabled
    assert pad.keys(event(1, 1, 5) + event(0, 1, 4)) == []
    assert pad.is_enabled
    assert pad.keys(event(0, 1, 5) + event(1, 1, 10)) == ["t"]
    assert not pad.is_enabled
    fifo = tmp_path / "js0"
    os.mkfifo(fifo)

    def unplugged(*_: int) -> bytes:
        raise OSError(errno.ENODEV, "No such device")

    with Gamepad(fifo) as device, fifo.open("wb", buffering=0) as file:
        file.write(event(1, 1, 4))
        assert device.pressed() == []
        assert device.is_enabled
        with monkeypatch.context() as gone:
            gone.setattr(os, "read", unplugged)
            assert device.pressed() == []
        assert not device.is_enabled


def test_a_pipe_whose_writer_has_ended_is_a_gamepad_that_is_gone(tmp_path: Path) -> None:
    fifo = tmp_path / "js0"
    os.mkfifo(fifo)
    with Gamepad(fifo) as device:
        assert device.pressed() == []
        assert device.gone is None, "no program has opened the pipe yet"
        with fifo.open("wb", buffering=0) as file:
            file.write(event(1, 1, 4))
            assert device.pressed() == []
            assert device.is_enabled
            assert device.gone is None
        assert device.pressed() == []
        assert device.gone is not None
        assert not device.is_enabled


@pytest.mark.parametrize(
    "command",
    [
        "gait=" + "x" * 500_000,
        "frequency_hz=" + "[" * 100_000,
        "frequency_hz=nan",
        "frequency_hz=1e999",
        "pad=1@soon",
        "\ufffd=\ufffd",
    ],
)
def test_a_damaged_command_of_the_page_is_one_short_line(command: str) -> None:
    hands = Hands()
    before = hands.operator.motion.gait.params
    hands.press(command, command)
    assert len(hands.said) == 1
    assert hands.said[0].startswith("refused: ")
    assert len(hands.said[0]) <= 320
    assert hands.operator.motion.gait.params == before


def test_conflicting_values_leave_the_last_and_pasted_text_holds_no_cycle_up() -> None:
    hands = Hands()
    hands.press("winding_rad=0.5", "winding_rad=0.6")
    assert hands.operator.motion.gait.params.winding_rad == 0.6
    hands.press(*["right"] * 5000)
    assert hands.said.count("refused: 5000 keys at once; only the first 100 count") == 1


def test_pasted_text_is_read_in_parts_and_a_closed_terminal_is_known() -> None:
    ours, theirs = pty.openpty()
    with Keyboard(theirs) as keyboard:
        os.write(ours, b"n" * 4000)
        assert len(keyboard.pressed()) <= 16 * 256
        assert keyboard.gone is None
        os.close(ours)
        for _ in range(3):  # what was typed before comes first
            keyboard.pressed()
        assert keyboard.gone is not None
        assert keyboard.pressed() == []
        other, keyboard._file = pty.openpty()  # there is one to restore
    for file in (other, keyboard._file, theirs):
        os.close(file)
