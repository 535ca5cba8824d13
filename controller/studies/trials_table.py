"""Table of trials, one tidy CSV with a row per finished run."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, fields
from pathlib import Path
from typing import get_type_hints

from pydantic import TypeAdapter

from snakewalk.controller.console.parquet import Kind
from snakewalk.controller.console.table import CsvTable
from snakewalk.controller.studies.trials import Case, Trial

_CASE = tuple(field.name for field in fields(Case))
_MEASURED_COLUMNS = tuple(f.name for f in fields(Trial) if f.name not in {"case", "seed"})
_PLACE = ("config", "start_spread_m", "seed")
COLUMNS = (*_CASE, *_PLACE, *_MEASURED_COLUMNS)
"""``config`` is the digest of the three files; ``keys`` are written as ``KEY=VALUE KEY=VALUE``."""

_NUMBERS = get_type_hints(Trial)
_BY_TYPE: dict[object, Kind] = {bool: "truth", int: "integer", float: "number"}
KINDS: dict[str, Kind] = {
    column: _BY_TYPE.get(_NUMBERS.get(column), "text") for column in COLUMNS
} | {"relief": "number", "start_spread_m": "number", "seed": "integer"}
"""Kind of each column in a Parquet file."""


class TrialsTable(CsvTable):
    """Finished trials."""

    def __init__(self, path: Path, configs: Mapping[Case, str], spread_m: float) -> None:
        """Open or make the table; ``configs`` holds the digest of each case.

        Raises:
            InputError: the file is something else.

        """
        super().__init__(path, columns=COLUMNS, place=_PLACE, command="trials run")
        self._configs = dict(configs)
        self._spread = f"{spread_m:g}"

    def finished(self, planned: Sequence[tuple[Case, int]]) -> list[Trial]:
        """The entries of ``planned`` that the table holds."""
        trials: list[Trial] = []
        for case, seed in planned:
            row = self.held(self._place_of_case(case, seed))
            if row is not None:
                values: dict[str, object] = {key: row[key] for key in _MEASURED_COLUMNS}
                start_m = row["start_m"].split() or None
                values |= {"case": case, "seed": seed, "start_m": start_m}
                trials.append(_TRIAL.validate_python(values))
        return trials

    def add(self, trial: Trial) -> None:
        """Append a finished trial."""
        case = asdict(trial.case)
        measured = asdict(trial)
        case["keys"] = " ".join(f"{key}={value}" for key, value in trial.case.keys)
        case["robot"], case["world"] = trial.case.robot or "", trial.case.world or ""
        case["compliance"] = {None: "", True: "on", False: "off"}[trial.case.compliance]
        measured["start_m"] = " ".join(map(str, trial.start_m or ()))
        place = dict(zip(_PLACE, self._place_of_case(trial.case, trial.seed), strict=True))
        self.append(case | place | {key: measured[key] for key in _MEASURED_COLUMNS})

    def _place_of_case(self, case: Case, seed: int) -> tuple[str, ...]:
        return (self._configs[case], self._spread, str(seed))


_TRIAL = TypeAdapter(Trial)
