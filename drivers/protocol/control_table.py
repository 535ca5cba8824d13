"""Control tables of the servo models, read from the files that the DYNAMIXEL SDK ships."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path
from types import MappingProxyType

from snakewalk.drivers.errors import ControlTableError

# The files mark only four registers as signed. These are all two's complement registers of the X,
# MX(2.0), P and PRO series in the e-manual (negative values in the column "Range").
_SIGNED = frozenset(
    {
        *("Homing Offset", "Goal PWM", "Goal Current", "Goal Velocity", "Goal Position"),
        *("Present PWM", "Present Load", "Present Current", "Present Velocity", "Present Position"),
        *("Velocity Trajectory", "Position Trajectory"),
        *("Max Position Limit", "Min Position Limit"),
    }
)

_SHUTDOWN_ADDRESS = 63
"""Of the layout that has Startup Configuration at 60."""


@dataclass(frozen=True, slots=True)
class Register:
    """Name, address and format of one register."""

    name: str
    address: int
    size: int
    """Bytes, little-endian."""
    signed: bool
    """Two's complement."""

    def decode(self, data: bytes) -> int:
        """Value of ``size`` bytes."""
        return int.from_bytes(data[: self.size], "little", signed=self.signed)

    def encode(self, value: int) -> bytes:
        """Bytes of a value.

        Raises:
            ControlTableError: it does not fit.

        """
        try:
            return value.to_bytes(self.size, "little", signed=self.signed)
        except OverflowError:
            raise ControlTableError(
                f"{self.name}: {value} does not fit in {self.size} byte(s)"
            ) from None


@dataclass(frozen=True, slots=True)
class ControlTable:
    """Registers of one model, and the scales in its file."""

    model: str
    """As printed on the servo: ``XM430-W350``."""
    model_number: int
    registers: Mapping[str, Register]
    zero_position: int
    """Raw position of 0 rad: straight."""
    rad_per_position: float
    rad_s_per_velocity: float | None
    """None where the file gives none."""

    def register(self, name: str) -> Register:
        """Look a register up by the SDK's name, ``Present Position``.

        Raises:
            ControlTableError: this model has none of that name.

        """
        try:
            return self.registers[name]
        except KeyError:
            near = [n for n in self.registers if n.lower() == name.lower()]
            hint = f"; you mean {near[0]}" if near else ""
            raise ControlTableError(f"{self.model}: has no register {name!r}{hint}") from None

    def __getitem__(self, name: str) -> Register:
        return self.register(name)

    @property
    def state_names(self) -> tuple[str, str, str]:
        """Registers of the state block: Present Current, or Load without a sensor, and two more."""
        first = "Present Current" if "Present Current" in self.registers else "Present Load"
        return (first, "Present Velocity", "Present Position")

    def __contains__(self, name: object) -> bool:
        return name in self.registers

    def __iter__(self) -> Iterator[str]:
        return iter(self.registers)


@cache
def model_numbers() -> Mapping[int, str]:
    """Names of all servos that the SDK knows, by model number."""
    lines = (_folder() / "dynamixel.model").read_text(encoding="utf-8").splitlines()[1:]
    numbers = (line.split("\t") for line in lines if line.strip())
    return MappingProxyType({int(n): _printed(file.strip()) for n, file in numbers})


def model_of(model_number: int) -> str:
    """Name of a model number (register 0).

    Raises:
        ControlTableError: the SDK does not know it.

    """
    try:
        return model_numbers()[model_number]
    except KeyError:
        raise ControlTableError(f"model number {model_number} is none that the SDK knows") from None


@cache
def load_control_table(model: str) -> ControlTable:
    """Control table of ``XM430-W350``; upper or lower case, ``_`` or ``-``.

    Raises:
        ControlTableError: the SDK has no table of that name, or is not installed.

    """
    printed = _printed(model)
    number = next((n for n, name in model_numbers().items() if name == printed), None)
    if number is None:
        shown = ", ".join(sorted(model_numbers().values()))
        raise ControlTableError(f"{model}: no such servo; the SDK has tables of {shown}")
    path = _folder() / f"{printed.lower().replace('-', '_')}.model"
    sections = _sections(path.read_text(encoding="utf-8"))
    info = {row[0]: float(row[1]) for row in sections["type info"]}
    units = {row[0]: float(row[1]) for row in sections["unit info"]}
    registers: dict[str, Register] = {}
    for address, size, name, *_ in sections["control table"]:
        registers.setdefault(name, Register(name, int(address), int(size), name in _SIGNED))
    shutdown = registers.get("Shutdown")
    if shutdown is not None and shutdown.address == _SHUTDOWN_ADDRESS:
        # in the e-manual's tables from firmware 45 (330: 46) on, but not in the SDK's files
        startup = Register("Startup Configuration", 60, 1, signed=False)
        registers.setdefault(startup.name, startup)
    zero = int(info["value_of_zero_radian_position"])
    # the lowest value is exactly -pi; on some models the highest is one step below +pi
    steps = zero - int(info["value_of_min_radian_position"])
    return ControlTable(
        model=printed,
        model_number=number,
        registers=MappingProxyType(registers),
        zero_position=zero,
        rad_per_position=math.pi / steps,
        rad_s_per_velocity=units.get("Present Velocity"),
    )


def _printed(name: str) -> str:
    return name.removesuffix(".model").upper().replace("_", "-")


def _sections(text: str) -> dict[str, list[list[str]]]:
    """Rows of each ``[section]`` without its heading line."""
    sections: dict[str, list[list[str]]] = {"type info": [], "unit info": [], "control table": []}
    rows: list[list[str]] = []
    for line in text.splitlines():
        cells = [cell.strip() for cell in line.split("\t")]
        if line.startswith("["):
            rows = sections.setdefault(line.strip().strip("[]"), [])
        elif len(cells) > 1 and cells[0] not in ("name", "Data Name", "Address"):
            rows.append(cells)
    return sections


@cache
def _folder() -> Path:
    package = find_spec("dynamixel_easy_sdk")  # without importing it
    if package is None or package.origin is None:
        raise ControlTableError("the DYNAMIXEL SDK is not installed: pip install dynamixel-sdk")
    return Path(package.origin).parent / "control_table"
