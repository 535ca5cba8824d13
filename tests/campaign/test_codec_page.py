"""The page of the control cycle has the benchmark's own figures."""

from benchmarks.codec_page import lines_of, measured_rows, table
from benchmarks.rows import Row


def rows(title: str, cpu_us: float, own: float | None) -> list[Row]:
    against = ("dynamixel-sdk", 0.1) if own is not None else ("", float("nan"))
    found = [Row(title, cpu_us, "us", *against)]
    if own is not None:
        found.append(Row("  the same", cpu_us, "us", "rustypot", own, 1.0))
    found.append(Row("  its time", 1.2, "ms", "wire time", 1.05))
    return [*found, Row("    after the last byte's time", 44.0, "us")]


ROWS = [
    *rows("3 Mbaud: cycle", 100.0, 0.8),
    *rows("3 Mbaud: rustypot", 125.0, None),
    *rows("4 Mbaud: cycle", 90.0, 0.9),
    *rows("4 Mbaud, fast: cycle", 80.0, 1.2),
]


def test_each_way_is_a_line_with_its_ratios() -> None:
    lines = lines_of(ROWS)
    assert [each.what for each in lines] == [
        *("3 Mbaud: cycle", "3 Mbaud: rustypot", "4 Mbaud: cycle", "4 Mbaud, fast: cycle")
    ]
    assert [each.of_rustypot for each in lines] == [0.8, None, 0.9, 1.2]
    assert table(lines).splitlines()[2] == "| 3 Mbaud: cycle | 100 | 0.10 | 0.80 | 5.0 % |"


def test_wall_times_are_those_of_a_quiet_machine() -> None:
    for is_quiet, text in ((True, "5.0 % with sync reads"), (False, "not measured on a")):
        cpu, wire = measured_rows(lines_of(ROWS), is_quiet=is_quiet).values()
        assert "0.80 to 0.90 of `rustypot` with sync reads, 1.20 with fast" in cpu
        assert text in wire


def test_a_row_of_several_calls_is_a_range() -> None:
    again = lines_of(rows("3 Mbaud: cycle", 120.0, 0.9))
    assert table([*lines_of(ROWS), *again]).splitlines()[2] == (
        "| 3 Mbaud: cycle | 100 to 120 | 0.10 | 0.80 to 0.90 | 5.0 % |"
    )
