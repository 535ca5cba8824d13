"""The strict base of every schema: unknown keys are faults, values are frozen."""

from typing import Annotated

from pydantic import BaseModel, ConfigDict, StringConstraints

from snakewalk.config.value_faults import NAME_PATTERN

Name = Annotated[str, StringConstraints(min_length=1, max_length=100, pattern=NAME_PATTERN)]
"""A name that becomes part of a file's: no path, nothing that steers a terminal, not hidden."""


class Strict(BaseModel):
    """Frozen, refuses unknown keys, NaN and infinities."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)
