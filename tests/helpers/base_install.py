"""Runs commands as the base install would, without the modules of extras and of the arguments.

Standard input is a JSON list of commands (lists of words), standard output a JSON list of
(exit code, standard output, standard error). The serial port ``./tty`` of a command is a line of 16
simulated servos with independent shafts, in simulated time.
"""

import io
import json
import os
import sys
import traceback
from collections.abc import Sequence
from contextlib import redirect_stderr, redirect_stdout
from importlib.machinery import ModuleSpec, PathFinder
from types import ModuleType, TracebackType
from typing import Any

from snakewalk.config.extras import EXTRAS

BLOCKED = frozenset({*EXTRAS, *sys.argv[1:]})


class BaseInstallFinder(PathFinder):
    """Finds what the path finder finds, except the extras' modules."""

    @classmethod
    def find_spec(
        cls, name: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return the module's spec; None for a module of an extra."""
        if name.partition(".")[0] in BLOCKED:
            return None
        return super().find_spec(name, path, target)


def hide_extras() -> None:
    """Make imports and ``find_spec`` blind to the blocked modules."""
    sys.meta_path[:] = [
        BaseInstallFinder if finder is PathFinder else finder for finder in sys.meta_path
    ]


def simulate_port() -> None:
    """Replace the serial port by simulated servos."""
    from snakewalk.drivers.port import network_port, serial_port
    from snakewalk.sim.serve.bench_line import bench_line
    from snakewalk.sim.serve.chain_spec import parse_chain

    class SimulatedPort:
        """What ``SerialPort(device, baud)`` opens here."""

        latency_s = 0.02
        latency_timer_ms = None

        def __init__(self, device: str, baud: int = 1_000_000, clock: object = None) -> None:
            self._line = bench_line(parse_chain("1-16"), baud)

        def __getattr__(self, name: str) -> Any:
            return getattr(self._line, name)

        def __enter__(self) -> "SimulatedPort":
            return self

        def __exit__(
            self,
            kind: type[BaseException] | None,
            error: BaseException | None,
            trace: TracebackType | None,
        ) -> None:
            pass

    serial_port.SerialPort = SimulatedPort  # type: ignore[assignment, misc]
    network_port.SerialPort = SimulatedPort  # type: ignore[attr-defined]


def call(words: Sequence[str]) -> tuple[int, str, str]:
    """Run ``snakewalk WORDS...``; return exit code, standard output, standard error."""
    from snakewalk.controller.cli.main import main
    from snakewalk.controller.console import options

    sys.argv = ["snakewalk", *words]
    out, err = io.StringIO(), io.StringIO()
    code = 0
    with redirect_stdout(out), redirect_stderr(err):
        options.console.file = out
        try:
            main()
        except SystemExit as ended:
            code = int(ended.code or 0)
        except BaseException:
            traceback.print_exc()
            code = 70
    return code, out.getvalue(), err.getvalue()


if __name__ == "__main__":
    hide_extras()
    simulate_port()
    os.symlink(os.ttyname(os.openpty()[1]), "tty")  # a device that exists
    results = [call(words) for words in json.load(sys.stdin)]
    json.dump(results, sys.stdout)
