"""The command line: ``snakewalk COMMAND --help``. One line registers a command."""

import sys
from pathlib import Path

import typer

from config.errors import InputError
from controller.app.commands.listing import list_
from controller.app.commands.plan import plan
from controller.app.commands.run import run
from controller.app.commands.trials import trials

app = typer.Typer(
    no_args_is_help=True,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
    help="Run gaits on a DYNAMIXEL servo snake, or on a simulated one that answers the same bytes.",
)


def _examples(*lines: str) -> str:
    return "\n\n".join(["Examples:", *(f"[bold]snakewalk {line}[/bold]" for line in lines)])


app.command("list", epilog=_examples("list --json"))(list_)
app.command(epilog=_examples("plan", "plan flat-slalom --motion serpenoid --json"))(plan)
app.command(
    epilog=_examples("run", "run flat-slalom --seed 3", "run my-run.toml --port /dev/ttyUSB0")
)(run)
app.command(
    epilog=_examples("trials flat-slalom --seeds 10 --motion walk --motion serpenoid --json")
)(trials)


def main() -> None:
    """Run the command line; bad input ends with exit code 2 and one line per fault."""
    try:
        app()
    except InputError as error:
        for line in error.faults:
            print(f"snakewalk: {line}", file=sys.stderr)
        raise SystemExit(2) from None
    except OSError as error:
        print(f"snakewalk: {Path(str(error.filename or ''))}: {error.strerror}", file=sys.stderr)
        raise SystemExit(2) from None
