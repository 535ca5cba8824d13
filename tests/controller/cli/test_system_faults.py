"""A fault of the system ends with exit code 1, a place that the user knows, and a remedy."""

import errno
import os

import pytest

from snakewalk.controller.cli import main


@pytest.mark.parametrize(
    ("number", "place", "said"),
    [
        (errno.EMFILE, "/lib/PIL/BmpImagePlugin.py", "too many open files; raise the limit"),
        (errno.ENOSPC, "out/log.mcap", "out/log.mcap: No space left on device; free space"),
        (errno.ENOSPC, None, "standard output: No space left on device; free space"),
    ],
)
def test_a_fault_of_the_system_is_no_bad_input(
    number: int, place: str | None, said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as ended:
        main._end_by(OSError(number, os.strerror(number), place))
    assert ended.value.code == 1
    assert capsys.readouterr().err.startswith(f"snakewalk: {said}")
