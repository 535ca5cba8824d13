"""Progress of a command that was interrupted, as a file of JSON."""

from pathlib import Path
from typing import TypeVar

from pydantic import BaseModel, ValidationError

from snakewalk.config.archive import MOST_JSON_BYTES, read_bytes
from snakewalk.config.errors import ConfigError

M = TypeVar("M", bound=BaseModel)


def read_progress(file: Path, kind: type[M]) -> M:
    """Progress of a command that was interrupted.

    Raises:
        ConfigError: the file is missing or broken.

    """
    try:
        return kind.model_validate_json(read_bytes(file, MOST_JSON_BYTES))
    except FileNotFoundError:
        raise ConfigError(
            f"{file}: no such file, so there is nothing to continue; leave --resume out"
        ) from None
    except ValidationError as error:
        fault = error.errors(include_url=False)[0]
        place = ".".join(map(str, fault["loc"]))
        raise ConfigError(f"{file}: {place}: {fault['msg']}; start again with --force") from None
