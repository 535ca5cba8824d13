"""Output without UTF-8, without a descriptor, and without memory ends in no traceback."""

import io
import subprocess
import sys

import pytest

from snakewalk.controller.cli import main as entry
from snakewalk.controller.console.safe_streams import make_streams_safe
from tests.helpers.command import snakewalk

LISTED = "from snakewalk.controller.cli.main import main; main()"


def test_a_character_that_the_encoding_lacks_is_escaped(monkeypatch: pytest.MonkeyPatch) -> None:
    data = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(data, "ascii", "surrogateescape"))
    make_streams_safe()
    print("müne", flush=True)
    assert data.getvalue() == rb"m\xfcne" + b"\n"


def test_the_choice_of_the_user_for_such_characters_is_kept(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    data = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(data, "ascii", "replace"))
    make_streams_safe()
    print("müne", flush=True)
    assert data.getvalue() == b"m?ne\n"


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


@pytest.mark.parametrize(
    "error",
    [
        MemoryError(),
        ImportError("libx.so: failed to map segment from shared object"),
    ],
)
def test_a_lack_of_memory_is_one_line(error: Exception, monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(words: list[str]) -> None:
        raise error

    monkeypatch.setattr(entry, "_check_words", fail)
    ended = snakewalk("list")
    assert ended.returncode == 2
    assert ended.stderr == (
        "snakewalk: not enough memory; end other programs, or raise the limit (ulimit -v)\n"
    )


def test_another_fault_of_an_import_is_not_called_a_lack_of_memory(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def fail(words: list[str]) -> None:
        raise ImportError("cannot import name 'x'")

    monkeypatch.setattr(entry, "_check_words", fail)
    with pytest.raises(ImportError, match="cannot import name"):
        snakewalk("list")
