"""Control tables of the servo models (files in `config/servos`)."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import MappingProxyType

from snakewalk.config.errors import ConfigError
from snakewalk.config.near_names import name_hint
from snakewalk.config.servo_catalogue import (
    models_by_number,
    servo_model,
    shipped_models,
)
from snakewalk.config.servo_model import ServoModel
from snakewalk.drivers.errors import ControlTableError

Model = str | ServoModel
"""Servo model by its name, or as a file describes it."""


@dataclass(frozen=True, slots=True)
class Register:
    """Name, address and format of one register."""

    name: str
    address: int
    size: int
    """Bytes, little-endian; ``FeetechBus`` converts words of another order."""
    signed: bool
    """Two's complement; ``FeetechBus`` converts words with a magnitude and a sign."""

    @property
    def kind(self) -> str:
        """Type of the register's numbers in a block, for numpy."""
        return f"<{'i' if self.signed else 'u'}{self.size}"

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


@dataclass(frozen=True, slots=True, eq=False)
class ControlTable:
    """Registers of one model."""

    facts: ServoModel
    registers: Mapping[str, Register]

    @property
    def model(self) -> str:
        """Name as printed on the servo: ``XM430-W350``."""
        return self.facts.model

    @property
    def model_number(self) -> int:
        """Register 0."""
        return self.facts.model_number

    @property
    def zero_position(self) -> int:
        """Raw position of 0 rad (straight)."""
        return self.facts.units.zero_position

    @property
    def rad_per_position(self) -> float:
        """Angle of one position."""
        return self.facts.rad_per_position

    def register(self, name: str) -> Register:
        """Look up a register by its e-manual name, ``Present Position``.

        Raises:
            ControlTableError: this model lacks it.

        """
        try:
            return self.registers[name]
        except KeyError:
            hint = name_hint(name, self.registers)
            raise ControlTableError(f"{self.model}: has no register {name!r}{hint}") from None

    def __getitem__(self, name: str) -> Register:
        return self.register(name)

    @property
    def state_names(self) -> tuple[str, str, str]:
        """Registers of the state block; Present Load replaces a missing Present Current."""
        first = "Present Current" if "Present Current" in self.registers else "Present Load"
        return (first, "Present Velocity", "Present Position")

    def __contains__(self, name: object) -> bool:
        return name in self.registers

    def __iter__(self) -> Iterator[str]:
        return iter(self.registers)


def model_numbers(protocol: int | str = 2) -> Mapping[int, str]:
    """Names of the known servos of a protocol by model number.

    Includes the files in the folder ``servos`` of the working directory.
    """
    return models_by_number(Path(), protocol)


def model_of(model_number: int) -> str:
    """Name of a model number (register 0).

    Raises:
        ControlTableError: no file describes it.

    """
    try:
        return model_numbers()[model_number]
    except KeyError:
        raise ControlTableError(
            f"model number {model_number} is not known; describe the model in a file: "
            "docs/how-to/add-a-servo-model.md"
        ) from None


def load_control_table(model: Model) -> ControlTable:
    """Control table of a model.

    ``model`` is a name such as ``XM430-W350`` (any case, ``_`` or ``-``), the path of a file, or a
    record.

    Raises:
        ControlTableError: the model does not exist, or has another protocol.

    """
    return _named_table(model) if isinstance(model, str) else _table(model)


@cache
def _named_table(model: str) -> ControlTable:
    try:
        return _table(servo_model(model, Path()))
    except ConfigError as error:
        raise ControlTableError(error.faults) from None


def _table(facts: ServoModel) -> ControlTable:
    if facts.protocol == 1:
        usable = ", ".join(name for name in shipped_models() if servo_model(name).protocol == 2)
        raise ControlTableError(
            f"{facts.model}: has Protocol 1.0; known models of Protocol 2.0 are {usable}"
        )
    registers = {
        name: Register(name, row.address, row.size, row.signed or row.sign_bit is not None)
        for name, row in facts.registers.items()
    }
    for address, data, _ in facts.indirect[:1]:
        for name, start_address, size in (
            ("Indirect Address 1", address, 2),
            ("Indirect Data 1", data, 1),
        ):
            registers[name] = Register(name, start_address, size, signed=False)
    return ControlTable(facts, MappingProxyType(registers))
