"""The strict base of every schema: unknown keys are faults, values are frozen."""

from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, StringConstraints

from snakewalk.config.field_facts import description_of
from snakewalk.config.value_faults import NAME_PATTERN

Name = Annotated[
    str,
    StringConstraints(min_length=1, max_length=100, pattern=NAME_PATTERN),
    Field(description="name in reports and file names; must not contain '/'"),
]
"""A name that becomes part of a file's: no path, nothing that steers a terminal, not hidden."""

Share = Annotated[float, Field(ge=0.0, lt=1.0)]
"""A share of something, below all of it."""


class Strict(BaseModel):
    """Frozen, refuses unknown keys, NaN and infinities; every key has a description."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    @classmethod
    def __pydantic_init_subclass__(cls, **kwargs: Any) -> None:
        """Reject a schema with a key that nobody can understand from its help.

        Raises:
            TypeError: names the field without a description.

        """
        super().__pydantic_init_subclass__(**kwargs)
        for name, field in cls.model_fields.items():
            if not description_of(field):
                raise TypeError(f"{cls.__name__}.{name}: has no description; add one to its Field")
