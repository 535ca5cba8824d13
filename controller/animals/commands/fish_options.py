"""Options that several ``snakewalk animal fish`` commands have."""

from pathlib import Path
from typing import Annotated

import typer

Picture = Annotated[Path | None, typer.Option(help="draw the result here (.png, .svg, .pdf)")]
