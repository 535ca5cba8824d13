"""Fixtures shared by all tests."""

import gc
import signal
from collections.abc import Iterator
from pathlib import Path

import pytest
from dynamixel_sdk import PortHandler
from hypothesis import settings

from snakewalk.controller.cli.main import leave_out_avx512
from tests.helpers.frozen import freeze

pytest_plugins = ["tests.tiers.cases", "tests.tiers.costs"]

# numpy is not imported yet: tests and the programs that they start compute the same bits, on a
# processor with AVX-512, too
leave_out_avx512()

# no test asserts wall-clock times: hypothesis would, at 200 ms an example
# and other examples are tried in every run: half as many as usual are enough for one
settings.register_profile("untimed", deadline=None, max_examples=50)
settings.load_profile("untimed")


def pytest_configure() -> None:
    """Have signals as a terminal has them, also where the tests were started by nohup or beside.

    The programs that a test starts inherit it.
    """
    for number, handler in (
        (signal.SIGINT, signal.default_int_handler),
        (signal.SIGHUP, signal.SIG_DFL),
        (signal.SIGQUIT, signal.SIG_DFL),
    ):
        if signal.getsignal(number) is signal.SIG_IGN:
            signal.signal(number, handler)


def pytest_collection_finish() -> None:
    """What was imported and collected stays to the end: cycles are looked for in what came since.

    And more seldom than in a program: with Python's thresholds that took 3 % of the suite's time.
    """
    gc.collect()
    freeze()
    gc.set_threshold(20_000, 20, 20)


@pytest.fixture(scope="session", autouse=True)
def own_stop_buttons(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """Runs of tests cannot be stopped by, nor be listed for, anybody else on this machine.

    The programs that a test starts inherit it.
    """
    with pytest.MonkeyPatch.context() as patch:
        folder = str(tmp_path_factory.mktemp("runtime"))
        patch.setenv("XDG_RUNTIME_DIR", folder)
        patch.setenv("TMPDIR", folder)
        yield


@pytest.fixture(scope="session", autouse=True)
def all_figures() -> Iterator[tuple[object, ...]]:
    """Return the figures of a report; reports of tests that do not read them have the first only.

    To draw them all takes longer than most runs of tests. ``whole_report`` is for tests that read.
    """
    from snakewalk.controller.report.figures import sections

    figures = sections._SECTIONS
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sections, "_SECTIONS", figures[:1])
        yield figures


@pytest.fixture(scope="module")
def whole_report(all_figures: tuple[object, ...]) -> Iterator[None]:
    """Draw every figure of the reports of a module's tests."""
    from snakewalk.controller.report.figures import sections

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sections, "_SECTIONS", all_figures)
        yield


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Folder of recordings made by other people; its tests are skipped where it is absent."""
    folder = Path(__file__).resolve().parents[2] / "shared" / "data"
    if not folder.is_dir():
        pytest.skip("recordings of other people are not beside this clone")
    return folder


def pytest_addoption(parser: pytest.Parser) -> None:
    """Where the metal is: ``pytest -m metal --port /dev/ttyUSB0 --robot yaw16``."""
    group = parser.getgroup("metal", "a real bus, for tests marked 'metal'")
    group.addoption("--port", help="serial device of the bus")
    group.addoption("--robot", default="yaw16", help="shipped robot or TOML file on that bus")


@pytest.fixture
def patient_sdk(monkeypatch: pytest.MonkeyPatch) -> None:
    """The SDK waits some 35 ms of real time for an answer; a busy machine may need more."""
    patience = 500.0
    real_ms = PortHandler.getCurrentTime
    monkeypatch.setattr(PortHandler, "getCurrentTime", lambda port: real_ms(port) / patience)
