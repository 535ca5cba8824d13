"""Servos on a command line: ``1-16``, ``1,2,5-8:XL330-M288``, ``1-2:XL430-W250,3:XM540-W270``.

A model applies to the IDs before it, back to the previous model. IDs after the last model have that
model. A model is a name, or the path of its file.
"""

from dataclasses import dataclass
from pathlib import Path

from snakewalk.config.errors import InputError
from snakewalk.config.robot import ImuConfig
from snakewalk.config.servo_catalogue import printed_name, servo_model
from snakewalk.config.servo_model import ServoModel
from snakewalk.drivers.port.port_map import id_range
from snakewalk.drivers.protocol.imu_table import IMU_TABLES

DEFAULT_MODEL = "XM430-W350"
IMU_EXAMPLE = "write 200, 200:imu_to_dxl or 200:FFW-G40-IMU"
BENCH_RANGES = {"gyro_range_dps": 2000.0, "acceleration_range_g": 4.0}
"""Ranges of a bench IMU whose table leaves them open (ours): write them into the robot's file."""
_EXAMPLE = "write 1-16, 1,2,5-8:XL330-M288 or 1-2:XL430-W250,3-6:XL330-M288"


@dataclass(frozen=True, slots=True)
class ChainSpec:
    """Servos along the chain."""

    ids: tuple[int, ...]
    """IDs of the servos in the order of the chain."""
    models: tuple[str, ...]
    """Name or file of each servo's model."""

    def records(self) -> tuple[ServoModel, ...]:
        """Record of each servo's model.

        Raises:
            InputError: the model does not exist, or the faults of its file.

        """
        records_by_model = {model: servo_model(model, Path()) for model in self.kinds}
        return tuple(records_by_model[model] for model in self.models)

    @property
    def kinds(self) -> tuple[str, ...]:
        """The different models, in the order of the chain."""
        return tuple(dict.fromkeys(self.models))

    @property
    def model(self) -> str:
        """The models, joined by a comma."""
        return ", ".join(self.kinds)


def parse_chain(text: str) -> ChainSpec:
    """Read ``IDS[:MODEL]``, joined by commas.

    Raises:
        InputError: no numbers, a reversed range, an ID outside 0 to 252, or a colon without a
            model.

    """
    ids: list[int] = []
    models: list[str] = []
    for piece in text.split(","):
        numbers, colon, model = (part.strip() for part in piece.partition(":"))
        if colon and not model:
            raise InputError(f"--servos {text}: {piece.strip()!r} names no model; {_EXAMPLE}")
        ids += id_range(numbers, f"--servos {text}", _EXAMPLE)
        if colon:
            is_file = model.endswith(".toml")
            models += [model if is_file else printed_name(model)] * (len(ids) - len(models))
    rest = models[-1] if models else DEFAULT_MODEL
    return ChainSpec(tuple(ids), (*models, *[rest] * (len(ids) - len(models))))


def parse_imu(text: str) -> ImuConfig:
    """Read ``ID[:MODEL]`` of an IMU on the bus of the servos.

    Raises:
        InputError: no ID, or an unknown model.

    """
    number, _, model = text.partition(":")
    source = f"--imu {text}"
    ids = id_range(number.strip(), source, IMU_EXAMPLE)
    if len(ids) != 1:
        raise InputError(f"{source}: one device has one ID; {IMU_EXAMPLE}")
    models_by_name = {model_name.upper(): model_name for model_name in IMU_TABLES}
    name = models_by_name.get((model.strip() or "imu_to_dxl").upper())
    if name is None:
        raise InputError(f"{source}: no such model; there are {', '.join(IMU_TABLES)}")
    ranges = {} if name == "imu_to_dxl" else BENCH_RANGES
    return ImuConfig.model_validate({"model": name, "id": ids[0], **ranges})
