"""A console of simulated servos: changes registers, loads, faults and pace during a run."""

import re
from collections.abc import Callable

from snakewalk.config.archive import parse_json
from snakewalk.config.errors import InputError
from snakewalk.config.faults import FaultPlan
from snakewalk.config.loader import checked
from snakewalk.drivers.errors import ControlTableError
from snakewalk.drivers.port.port_map import id_range
from snakewalk.sim.faults.fault_player import FaultPlayer
from snakewalk.sim.line.sim_line import SimLine
from snakewalk.sim.serve.register_access import register_name, rows_of, set_load, set_register

_BEFORE_KEY = re.compile(r" (?=\w+=)")
"""Space between two pairs of key and value; a value may contain spaces."""
HELP = """\
set IDS REGISTER VALUE    set 3 Homing Offset 100; IDS: 3, 1-4, 1,3,5-8 or all
get IDS REGISTER          get all Present Position
load IDS NM               a constant torque on shafts of a bench, N m: load 2 -0.4
fault KIND KEY=VALUE ...  as in a fault file, from now on: fault mute ids=[3] for_s=2
pace FACTOR               simulated seconds a second
quit"""


class Console:
    """Executes lines of an operator."""

    def __init__(self, line: SimLine, faults: FaultPlayer) -> None:
        self._line = line
        self._faults = faults
        self.set_pace: Callable[[float], None] | None = None
        """Sets a new factor of time; None while no server runs the line in real time."""
        self._commands: dict[str, Callable[[list[str]], str]] = {
            "set": self._set_command,
            "get": self._get,
            "load": self._load,
            "fault": self._fault,
            "pace": self._change_pace,
            "help": lambda words: HELP,
        }

    def execute(self, text: str) -> str:
        """Execute a line; return its result or fault."""
        word, *rest = text.split() or ["help"]
        do = self._commands.get(word)
        if do is None:
            return f"{word}: no such command\n{HELP}"
        self._line.settle()
        try:
            return do(rest)
        except (InputError, ControlTableError) as error:
            return str(error)
        except (ValueError, IndexError):
            usage = next(line for line in HELP.splitlines() if line.startswith(word))
            return f"write {usage}"

    def _rows(self, text: str) -> list[int]:
        if text == "all":
            return rows_of(self._line, None)
        asked = [
            servo_id
            for piece in text.split(",")
            for servo_id in id_range(piece, "IDS", "write 1-4")
        ]
        return rows_of(self._line, asked)

    def _set_command(self, words: list[str]) -> str:
        if len(words) < 3:
            raise ValueError
        rows = self._rows(words[0])
        value = int(words[-1], 0)
        name = set_register(self._line, rows, " ".join(words[1:-1]), value)
        return f"{name} = {value} at {len(rows)} servo{'s' if len(rows) > 1 else ''}"

    def _get(self, words: list[str]) -> str:
        rows = self._rows(words[0])
        name = register_name(self._line, " ".join(words[1:]), rows)
        values = self._line.shown(name)
        ids = self._line.ids()
        return "  ".join(f"{ids[row]}: {values[row]}" for row in rows)

    def _load(self, words: list[str]) -> str:
        rows = self._rows(words[0])
        load_n_m = float(words[1])
        set_load(self._line, rows, load_n_m)
        return f"{load_n_m:g} N m on {len(rows)} shaft{'s' if len(rows) > 1 else ''}"

    def _fault(self, words: list[str]) -> str:
        table: dict[str, object] = {"kind": words[0]}
        for word in _BEFORE_KEY.split(" ".join(words[1:])) if words[1:] else ():
            key, equals, value = word.partition("=")
            if not equals:
                raise ValueError
            table[key] = parse_json(value)
        plan = checked(FaultPlan, {"fault": [table]}, "fault")
        self._faults.add(plan)
        return f"{words[0]}: from now on"

    def _change_pace(self, words: list[str]) -> str:
        if self.set_pace is None:
            raise InputError("pace: nobody serves this line in real time")
        self.set_pace(float(words[0]))
        return f"pace {float(words[0]):g}"
