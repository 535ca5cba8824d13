"""A table of results as Parquet, converted block by block from its CSV."""

from collections.abc import Mapping
from importlib import import_module
from pathlib import Path
from typing import Literal

from snakewalk.config.extras import require_extra
from snakewalk.controller.console.result_files import atomic_write

Kind = Literal["text", "integer", "number", "truth"]
BLOCK_BYTES = 1 << 22
"""Bytes of the CSV that are in memory at a time (ours)."""


def check_parquet(path: Path | None) -> None:
    """Reject a Parquet file without its package, before any work.

    Raises:
        InputError: pyarrow is not installed.

    """
    if path is not None:
        require_extra("Parquet needs", "pyarrow")


def table_to_parquet(table: Path, path: Path, kinds: Mapping[str, Kind]) -> int:
    """Write a CSV table as Parquet and return its number of rows; empty cells are null.

    ``kinds`` has the kind of each column, in order.
    """
    pa, csv, parquet = (import_module(f"pyarrow{part}") for part in ("", ".csv", ".parquet"))
    types = {
        "text": pa.string(),
        "integer": pa.int64(),
        "number": pa.float64(),
        "truth": pa.bool_(),
    }
    schema = pa.schema([(name, types[kind]) for name, kind in kinds.items()])
    rows = 0
    with atomic_write(path) as part, parquet.ParquetWriter(part, schema) as writer:
        reader = csv.open_csv(
            table,
            read_options=csv.ReadOptions(block_size=BLOCK_BYTES),
            convert_options=csv.ConvertOptions(
                column_types=schema,
                include_columns=list(kinds),
                null_values=[""],
                strings_can_be_null=True,
            ),
            parse_options=csv.ParseOptions(newlines_in_values=True),
        )
        for batch in reader:
            writer.write_batch(batch)
            rows += batch.num_rows
    return rows
