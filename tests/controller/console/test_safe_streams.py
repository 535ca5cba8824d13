"""Output without UTF-8, without a descriptor, and without memory ends in no traceback."""

import io
import subprocess
import sys
from collections.abc import Callable
from contextlib import redirect_stdout

import pytest

from snakewalk.controller.cli import main as entry
from snakewalk.controller.cli.main import make_streams_safe
from tests.helpers.command import snakewalk

LISTED = "from snakewalk.controller.cli.main import main; main()"


@pytest.mark.parametrize(
    ("errors", "written"),
    [("surrogateescape", rb"m\xfcne" + b"\n"), ("replace", b"m?ne\n")],
)
def test_a_character_that_the_encoding_lacks_is_escaped_unless_the_user_chose(
    errors: str, written: bytes
) -> None:
    data = io.BytesIO()
    stream = io.TextIOWrapper(data, "ascii", errors)
    with redirect_stdout(stream):
        make_streams_safe()
        print("müne", flush=True)
    assert data.getvalue() == written


@pytest.mark.costs("a program from nothing: a closed descriptor needs a process")
def test_a_command_without_standard_streams_behaves_as_with_the_null_device() -> None:
    words = [sys.executable, "-c", LISTED, "--help"]
    closed = subprocess.run(
        ["sh", "-c", 'exec "$@" <&- >&-', "sh", *words],
        check=False,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert (closed.returncode, closed.stderr) == (0, "")


def test_a_name_that_the_locale_lacks_is_not_called_a_wrong_name(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(sys, "getfilesystemencoding", lambda: "ascii")
    ended = snakewalk("init", "m\udcc3\udca4ne")
    assert ended.returncode == 2
    assert ended.stderr == (
        "snakewalk: mäne: this locale cannot represent the name; set PYTHONUTF8=1\n"
    )


@pytest.fixture
def failing(monkeypatch: pytest.MonkeyPatch) -> Callable[[Exception], None]:
    """Let every command end in an exception."""

    def fail_with(error: Exception) -> None:
        def fail(words: list[str]) -> None:
            raise error

        monkeypatch.setattr(entry, "_check_words", fail)

    return fail_with


@pytest.mark.parametrize(
    "error",
    [
        MemoryError(),
        ImportError("libx.so: failed to map segment from shared object"),
    ],
)
def test_a_lack_of_memory_is_one_line(
    error: Exception, failing: Callable[[Exception], None]
) -> None:
    failing(error)
    ended = snakewalk("list")
    assert ended.returncode == 2
    assert ended.stderr == (
        "snakewalk: not enough memory; end other programs, or raise the limit (ulimit -v)\n"
    )


def test_another_fault_of_an_import_is_not_called_a_lack_of_memory(
    failing: Callable[[Exception], None],
) -> None:
    failing(ImportError("cannot import name 'x'"))
    with pytest.raises(ImportError, match="cannot import name"):
        snakewalk("list")


@pytest.mark.costs("a program from nothing: a limit of memory needs a process")
def test_a_limit_of_memory_at_which_loading_never_ends_is_named() -> None:
    limited = (
        f"import resource; resource.setrlimit(resource.RLIMIT_AS, 2 * (400 * 2**20,)); {LISTED}"
    )
    ended = subprocess.run(
        [sys.executable, "-c", limited, "plan"], check=False, capture_output=True, text=True
    )
    assert ended.returncode == 2
    assert ended.stderr.startswith("snakewalk: not enough memory; ")
