"""Reports of rejected commands are limited, whatever comes."""

from snakewalk.controller.motion.refusals import LINES_MAX, TEXT_MAX, Refusals


def test_the_same_line_comes_once_a_second() -> None:
    lines: list[str] = []
    refusals = Refusals(lines.append)
    for k in range(150):
        refusals.add("joint9 has no joint", 0.02 * k)
    assert lines == ["joint9 has no joint"] * 3


def test_a_flood_of_different_lines_is_counted() -> None:
    lines: list[str] = []
    refusals = Refusals(lines.append)
    for k in range(1000):
        refusals.add(f"joint{k} has no joint", 0.5)
    assert lines == [f"joint{k} has no joint" for k in range(LINES_MAX)]
    refusals.step(1.6)
    assert lines[LINES_MAX:] == ["990 more commands were rejected"]
    refusals.step(9.0)
    refusals.add("again", 9.0)
    assert lines[LINES_MAX + 1 :] == ["again"]


def test_a_line_is_never_longer_than_a_person_reads() -> None:
    lines: list[str] = []
    Refusals(lines.append).add("x" * 2_000_000, 0.0)
    assert len(lines[0]) == TEXT_MAX
