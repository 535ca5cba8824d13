"""Options that several ``snakewalk animal fish`` commands have."""

from pathlib import Path
from typing import Annotated

import typer

from snakewalk.config.errors import InputError

Picture = Annotated[Path | None, typer.Option(help="draw the result here (.png, .svg, .pdf)")]


def check_npz(path: Path) -> None:
    """Reject a result file whose name does not end in .npz."""
    if path.suffix.lower() != ".npz":
        raise InputError(f"{path}: the result is an .npz; change the ending")
