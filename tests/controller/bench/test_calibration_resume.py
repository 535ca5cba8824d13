"""No answer to ``bus calibrate`` is lost, whatever ends it or the line does to it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import pytest

from benchmarks.busy_calibrations import calibrated
from snakewalk.config.errors import ConfigError, InputError
from snakewalk.config.faults import FaultPlan
from snakewalk.config.loader import load_robot
from snakewalk.controller.bench.calibration.chain_calibration import calibrate
from snakewalk.controller.bench.calibration.progress import ProgressFile, SeenBend
from snakewalk.drivers.errors import SafetyTrippedError
from snakewalk.sim.faults.fault_player import FaultPlayer
from tests.controller.bench.test_chain_calibration import Trio, trio

__all__ = ["trio"]

BENDS = {4: SeenBend(joint=2, direction=-1), 9: SeenBend(joint=0, direction=1)}
BENDS |= {30: SeenBend(joint=1, direction=-1)}


@dataclass
class Script:
    """Gives each servo's answer once; keeps the questions."""

    asked: list[int] = field(default_factory=list)
    straightened: int = 0

    def which(
        self, servo_id: int, wiggle: Callable[[], None], known: Mapping[int, int]
    ) -> SeenBend:
        wiggle()
        self.asked.append(servo_id)
        return BENDS[servo_id]

    def straighten(self) -> None:
        self.straightened += 1


def faults(trio: Trio, *tables: dict[str, object], seed: int = 1) -> None:
    plan = {"seed": seed, "fault": list(tables)}
    FaultPlayer(trio.line, FaultPlan.model_validate(plan))


@pytest.mark.slow
def test_answers_before_an_interruption_are_not_asked_again(trio: Trio) -> None:
    broken = trio(answers="3\nr\n1\n")
    part = trio.folder / "mine.toml.part"
    assert f"{part}: holds the answers so far; continue" in broken.output
    assert not trio.out.exists()
    refused = trio(answers="")
    assert "continue it with --resume, or start again with --force" in str(refused.exception)
    result = trio("--resume", answers="1\nl\n2\nd\n\n")
    assert result.exit_code == 0, result.output
    assert "1 of 3 joints known" in result.output
    assert "ID 4: which joint" not in result.output
    found = load_robot(str(trio.out))
    assert (found.servo_ids, found.signs) == (trio.robot.servo_ids, trio.robot.signs)
    assert not part.exists()


@pytest.mark.slow
def test_a_range_that_was_not_swept_is_swept_after_a_restart(trio: Trio) -> None:
    file, script = ProgressFile(trio.out), Script()
    like = load_robot(str(trio.folder / "like.toml"))
    journal = file.start(like, resume=False, force=False)

    def stop_after_one_range() -> str | None:
        return "somebody pressed stop" if len(journal.known.ranges) == 1 else None

    with pytest.raises(SafetyTrippedError, match="pressed stop"):
        calibrate(
            trio.line,
            like,
            script,
            name="mine",
            journal=journal,
            stop_requested=stop_after_one_range,
        )
    again = file.start(like, resume=True, force=False)
    assert again.known == journal.known
    found = calibrate(trio.line, like, script, name="mine", journal=again)
    assert (script.asked, script.straightened) == ([4, 9, 30], 1)
    assert len(found.ranges) == 3


def test_a_progress_file_of_another_robot_or_bus_is_rejected(trio: Trio) -> None:
    file = ProgressFile(trio.out)
    like = load_robot(str(trio.folder / "like.toml"))
    with pytest.raises(InputError, match="nothing to continue; leave --resume out"):
        file.start(like, resume=True, force=False)
    journal = file.start(like, resume=False, force=False)
    journal.note(servos={4: "XM430-W350", 9: "XM430-W350", 31: "XM430-W350"}, bends=BENDS)
    with pytest.raises(InputError, match="ID 4, 9, 31, the bus has 4, 9, 30"):
        calibrate(trio.line, like, Script(), name="mine", journal=journal)
    other = like.model_copy(update={"joint_axes": "yyp"})
    with pytest.raises(InputError, match="made for joint_axes ypy, robot trio has yyp"):
        file.start(other, resume=True, force=False)
    file.path.write_text('{"joint_axes": "ypy", "bends": {"4": {"joint": 2, "direction": 5}}}')
    with pytest.raises(ConfigError, match=r"bends.4.direction: .*start again with --force"):
        file.start(like, resume=True, force=False)


@pytest.mark.slow
def test_every_repeated_question_has_its_reason(trio: Trio) -> None:
    answers = "what\n0\n3\nx\nr\n1\nl\n1\n2\nl\nd\n\n"
    result = trio(answers=answers)
    assert result.exit_code == 0, result.output
    for reason in (
        "'what': not a joint; type a number from 1 to 3, or a to see ID 4 move again",
        "'0': not a joint",
        "3 is joint yaw_03 (ID 4): the head side went",
        "'x': not a direction of this joint; type l or r, or a",
        "1 is joint yaw_01 (ID 9), assigned by an earlier answer; ID 30 moves again, one of the "
        "joints 2",
        "'l': not a direction of this joint; type u or d",
    ):
        assert reason in result.output, result.output


def test_an_interrupted_motion_says_that_torque_is_off(trio: Trio) -> None:
    """Ctrl-C in a range printed only "interrupted"."""
    file, like = ProgressFile(trio.out), load_robot(str(trio.folder / "like.toml"))
    journal = file.start(like, resume=False, force=False)

    def interrupt_after_one_range() -> str | None:
        if len(journal.known.ranges) == 1:
            raise KeyboardInterrupt
        return None

    with pytest.raises(KeyboardInterrupt) as stop:
        calibrate(
            trio.line,
            like,
            Script(),
            name="mine",
            journal=journal,
            stop_requested=interrupt_after_one_range,
        )
    assert stop.value.__notes__ == ["torque is off"]


def test_an_overload_has_the_advice_to_hang_the_robot_up(trio: Trio) -> None:
    faults(trio, {"kind": "overload", "ids": [4], "at_s": 2.0})
    result = trio()
    assert isinstance(result.exception, SafetyTrippedError)
    assert "joint servo_4 (ID 4): alarm: overload; hang the robot up" in str(result.exception)
    assert "snakewalk bus reboot --id 4" in str(result.exception)
    assert not ProgressFile(trio.out).path.exists()  # there is no answer to keep
    again = trio()
    assert "hang the robot up, so that its joints carry no weight" in str(again.exception)


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("seed", range(1, 4))
def test_no_answer_is_lost_on_a_busy_machine(seed: int) -> None:
    """Three of the 20 of ``python -m benchmarks busy_calibrations``, without the sweep."""
    result = calibrated(seed, sweep=False)
    assert (result.lost, result.is_right) == (0, True)
    assert result.repeated > 0  # the machine was busy


@pytest.mark.slow
def test_a_calibration_stops_at_any_question(trio: Trio) -> None:
    result = trio(answers="3\nl\nq\n")
    assert result.exit_code == 130
    assert "which joint moved? 1 is next to the head, a = again, q = stop: " in result.output
    assert "--resume" in result.output
    assert trio.out.with_name(trio.out.name + ".part").exists()
