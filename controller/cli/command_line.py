"""The command line: every command that a manifest lists, imported when it is called."""

import re
import sys
from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import contextmanager
from difflib import get_close_matches
from importlib.metadata import version
from itertools import pairwise
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup

from snakewalk.controller.cli.called_command import CalledCommand, called, with_kinds
from snakewalk.controller.console.command import CommandInfo, command_info, declaration
from snakewalk.controller.console.plugins import Plugin, plugins
from snakewalk.drivers.errors import notes_of

EVERY_DAY = "Every day"
SUBJECTS = "By subject"
OTHERS = "Other packages"
"""Groups of ``snakewalk --help``; a command of another package may name its own."""
VERBS = (
    "demo",
    "setup",
    "init",
    "list",
    "plan",
    "run",
    "play",
    "stop",
    "view",
    "doctor",
    "trials",
)
"""First words of the group ``EVERY_DAY``, in their order."""
FAMILIES = {
    "trials": "Many runs",
    "gait": "Gaits",
    "gait policy": "Learnt policies",
    "gait repertoire": "Actions recorded from the physics",
    "log": "The log of a run",
    "bus": "Servos and their settings",
    "robot": "A robot",
    "world": "Worlds from real ground",
    "animal": "Animals from video",
    "animal fish": "Fish from video",
    "pose": "Measured poses",
    "ros": "",
    "tools": "Tools",
}
"""Subject of commands that begin with the same words; ``ros`` is one command."""
FORMER = {
    "trials": "trials run",
    "rehearse": "trials rehearse",
    "tasks": "trials tasks",
    "policy trials": "trials policy",
    "policy": "gait policy",
    "repertoire": "gait repertoire",
    "sweep": "gait sweep",
    "tune": "gait tune",
    "report": "log report",
    "export": "log export",
    "compare": "log compare",
    "replay": "log replay",
    "shadow": "log shadow",
    "judge": "log judge",
    "scan": "bus scan",
    "calibrate": "bus calibrate",
    "bus identify": "bus inventory",
    "identify": "robot identify",
    "terrain from-stereo": "world stereo",
    "terrain": "world",
    "camera board": "pose board",
    "camera calibrate": "pose lens",
    "camera check": "pose camera",
    "camera markers": "pose markers",
    "camera": "pose",
    "capture": "animal capture",
    "track": "animal track",
    "analyse": "animal analyse",
    "stride": "animal stride",
    "body": "animal body",
    "synthesise": "animal synthesise",
    "people": "animal people",
    "fish": "animal fish",
    "walk": "animal graph",
    "compile": "tools compile",
    "schema": "tools schema",
}
"""Current words by former words, of commands and of families."""


def former_name(words: Sequence[str], names: Collection[str]) -> tuple[str, str] | None:
    """Return the former name with which the words begin, and the current one.

    Args:
        words: the words of a command line behind ``snakewalk``.
        names: the names of all commands. A former name has no effect if one of them begins with it,
            or if none begins with the current one.

    """
    for count in (2, 1):
        old = " ".join(words[:count])
        new = FORMER.get(old, "")
        if not new or not _following_words(new, names):
            continue
        kinds = _following_words(old, names)
        if not kinds or (new.startswith(f"{old} ") and _is_argument(words[count:], kinds)):
            return old, new
    return None


def _following_words(words: str, names: Collection[str]) -> list[str]:
    """Return the words that follow, an empty one for a command of this name."""
    return [
        f"{name} ".removeprefix(f"{words} ") for name in names if f"{name} ".startswith(f"{words} ")
    ]


def _is_argument(rest: Sequence[str], kinds: Sequence[str]) -> bool:
    """Whether words follow that are neither a request for help nor, with an error, a kind."""
    kind_names = [kind.split()[0] for kind in kinds]
    return (
        bool(rest)
        and rest[0] not in ("-h", "--help")
        and not get_close_matches(rest[0], kind_names)
    )


_FIRST_WORDS = (*VERBS, *(words for words in FAMILIES if " " not in words))
"""First words in the order of ``--help``; those of other packages follow by name."""
_COMMON = ("robot", "world", "run", "motion", "port", "seconds")
"""Options that come first in the help of a command; the others follow as declared."""
_PANELS = {
    "Display": ("view", "view_at", "ros", "observe"),
    "Results": (
        "out",
        "output",
        "robot_out",
        "film",
        "look",
        "fine",
        "picture",
        "overlay",
        "sheet",
        "record",
        "truth",
        "folders",
        "accept_dead_reckoning",
        "as_json",
        "force",
    ),
}
"""Options by their group in the help of a command; the others are in its first group."""
_USAGE = "COMMAND ... | --version | --install-completion | --help (-h)"
_CONTEXT: dict[str, Any] = {"help_option_names": ["-h", "--help"]}


class CommandGroup(TyperGroup):
    """Commands by name, each imported when it is called; the list needs their manifests only."""

    prefix = ""
    """First word of a family's commands."""
    _is_listing = False

    def list_commands(self, ctx: Any) -> list[str]:
        """Return the words that may follow."""
        words = dict.fromkeys(
            _next_word(plugin, self.prefix) for plugin in _listed_commands(self.prefix)
        )
        return [*words]

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Return a command with its options, a family, or None."""
        entries = [
            e for e in _listed_commands(self.prefix) if _next_word(e, self.prefix) == cmd_name
        ]
        if not entries:
            return None
        path = f"{self.prefix} {cmd_name}".strip()
        if entries[0].name != path:
            return _family(path, entries)
        return (
            TyperCommand(cmd_name, help=entries[0].help, rich_markup_mode="rich")
            if self._is_listing
            else _full_command(cmd_name, entries[0])
        )

    def get_params(self, ctx: Any) -> list[Any]:
        """Return the options before a command."""
        return with_kinds(super().get_params(ctx))

    def resolve_command(self, ctx: Any, args: list[str]) -> Any:
        """Return the command that the first word names; an unknown word gets a suggestion."""
        try:
            return super().resolve_command(ctx, args)
        except Exception as error:
            if hasattr(error, "message"):  # an error of typer's or click's
                error.message = error.message.rstrip(".") + self._suggestion(ctx, args[0])
            raise

    def _suggestion(self, ctx: Any, word: str) -> str:
        """Return the commands of a similar name: those below this prefix, else any other."""
        near = get_close_matches(word, self.list_commands(ctx), 2, 0.7)
        meant = [f"{self.prefix} {suggestion}".strip() for suggestion in near]
        if not meant:
            names = {
                plugin.name.split()[-1]: plugin.name for plugin in reversed(_listed_commands(""))
            }
            meant = [f"snakewalk {names[near]}" for near in get_close_matches(word, names, 1, 0.8)]
        return f"; did you mean {' or '.join(meant)}?" if meant else ""

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Print the list of commands from their manifests; the first level fits a screen."""
        with self._listing():
            if self.prefix:
                super().format_help(ctx, formatter)
                return
            formatter.write_usage(ctx.command_path, _USAGE)
            formatter.write(f"{self.help}\n")
            groups: dict[str, list[tuple[str, str]]] = {}
            for name, title in {_next_word(e, ""): _title(e) for e in _listed_commands("")}.items():
                groups.setdefault(title, []).append((name, self.get_command(ctx, name).help))
            for title, rows in groups.items():
                formatter.write(f"{title}\n")
                with formatter.indentation():
                    formatter.write_dl(rows)

    def shell_complete(self, ctx: Any, incomplete: str) -> Any:
        """Complete a command's name from the manifests."""
        with self._listing():
            return super().shell_complete(ctx, incomplete)

    @contextmanager
    def _listing(self) -> Iterator[None]:
        self._is_listing = True
        try:
            yield
        finally:
            self._is_listing = False

    def main(
        self,
        args: Any = None,
        prog_name: str | None = None,
        complete_var: str | None = None,
        standalone_mode: bool = True,
        *more: Any,
        **options: Any,
    ) -> Any:
        """Run the command line of a process; wrong words end it with one line and exit code 2."""
        if not standalone_mode:
            return super().main(args, prog_name, complete_var, False, *more, **options)
        try:
            code = super().main(args, prog_name, complete_var, False, *more, **options)
        except Exception as error:
            if hasattr(error, "exit_code"):  # an error of typer's or click's
                _print_fault(error)
                raise SystemExit(error.exit_code) from None
            if type(error).__name__ != "Abort":
                raise
            print("snakewalk: aborted", file=sys.stderr)
            raise SystemExit(1) from None
        raise SystemExit(code if isinstance(code, int) else 0)

    def make_context(self, info_name: Any, args: list[str], *more: Any, **options: Any) -> Any:
        """Read the words before a command's name; an empty word is rejected."""
        for before, word in pairwise([self.name or "snakewalk", *args]):
            name = before if word == "" else word.removesuffix("=")
            if word == "" or (word.startswith("--") and name != word):
                raise typer.BadParameter(f"nothing after {name}: fill it, or leave it out")
        return super().make_context(info_name, args, *more, **options)

    def parse_args(self, ctx: Any, args: list[str]) -> Any:
        """Read the words of a command line; a former name of a command becomes the current one."""
        names = {plugin.name for plugin in _listed_commands("")}
        renamed = None if self.prefix else former_name(args, names)
        if renamed is not None:
            old, new = renamed
            if not ctx.resilient_parsing:  # of completion
                print(f"snakewalk {old} is now snakewalk {new}", file=sys.stderr)
            args = [*new.split(), *args[len(old.split()) :]]
        return super().parse_args(ctx, args)

    def invoke(self, ctx: Any) -> Any:
        """Run a command; after an interrupt, print the notes about torque and log."""
        try:
            return super().invoke(ctx)
        except KeyboardInterrupt as stop:
            text = "; ".join(["interrupted", *notes_of(stop)])
            print(f"snakewalk: {text}", file=sys.stderr)
            raise SystemExit(130) from None


def _print_fault(error: Any) -> None:
    """Print in one line what is wrong with a command's words."""
    if type(error).__name__ == "NoArgsIsHelpError":  # its help has been shown
        return
    context = getattr(error, "ctx", None)
    path = "snakewalk" if context is None else context.command_path
    text = " ".join(error.format_message().split())
    if getattr(error, "possibilities", None):  # of an unknown option
        near = get_close_matches(error.option_name, error.possibilities, 1)
        text = f"{error.message}; did you mean {near[0]}?" if near else error.message
    text = re.sub(r"^Invalid value for '([^']+)'(?: / '[^']+')*: ", r"\1: ", text)
    text = re.sub(r": (?:dir|file) ('.*' is a (?:file|directory))\.$", r": \1", text)
    text = re.sub(r"^Missing (?:option|argument) '([^']+)'.*$", r"\1: is required", text)
    print(f"snakewalk: {text} (see {path} --help)", file=sys.stderr)


def _listed_commands(prefix: str) -> list[Plugin]:
    """Return the commands below a prefix in the order of ``--help``."""
    commands: dict[str, Plugin] = {}
    for plugin in plugins("command"):
        if not prefix or plugin.name.startswith(f"{prefix} "):
            commands.setdefault(plugin.name, plugin)

    def order(plugin: Plugin) -> tuple[int, str]:
        first = plugin.name.split()[0]
        return _FIRST_WORDS.index(first) if first in _FIRST_WORDS else len(
            _FIRST_WORDS
        ), plugin.name

    return sorted(commands.values(), key=order)


def _title(plugin: Plugin) -> str:
    """Return the group of a command, or of its family, in ``--help`` of the first level."""
    first = plugin.name.split()[0]
    if first in _FIRST_WORDS:
        return EVERY_DAY if first in VERBS else SUBJECTS
    return plugin.group or OTHERS


def _next_word(plugin: Plugin, prefix: str) -> str:
    return plugin.name.removeprefix(prefix).split()[0]


def _family(path: str, commands: list[Plugin]) -> Any:
    """Return the group of the commands that begin with the same word."""
    about = FAMILIES.get(path, f"Commands of {commands[0].package}")
    about += f": {', '.join(dict.fromkeys(_next_word(command, path) for command in commands))}."
    group_class = type("Family", (CommandGroup,), {"prefix": path})
    family = typer.Typer(
        cls=group_class, help=about, rich_markup_mode="rich", context_settings=_CONTEXT
    )
    family.callback(no_args_is_help=True, help=about)(lambda: None)
    group = typer.main.get_group(family)
    group.name = path.rsplit(maxsplit=1)[-1]
    return group


def _full_command(name: str, listed: Plugin) -> Any:
    """Build the options of a command; its module is imported when it is called."""
    declared = declaration(listed.target) if listed.is_builtin else None
    function: Callable[..., Any] = declared or listed.load()
    info = command_info(function)
    alone = typer.Typer(add_completion=False, rich_markup_mode="rich", context_settings=_CONTEXT)
    alone.command(name, cls=CalledCommand, epilog=_examples(info))(called(function, listed.load))
    click_command = typer.main.get_command(alone)
    _group_options(click_command)
    return click_command


def _group_options(command: Any) -> None:
    panels = {name: panel for panel, names in _PANELS.items() for name in names}

    def place(parameter: Any) -> int:
        if parameter.param_type_name == "argument":
            return -1
        return _COMMON.index(parameter.name) if parameter.name in _COMMON else len(_COMMON)

    command.params.sort(key=place)
    for parameter in command.params:
        if parameter.param_type_name == "option" and not parameter.rich_help_panel:
            parameter.rich_help_panel = panels.get(parameter.name)


def _examples(info: CommandInfo) -> str:
    lines = (f"[bold]snakewalk {line}[/bold]" for line in info.examples)
    return "\n\n".join(["Examples:", *lines]) if info.examples else ""


def _show_version(is_asked: bool) -> None:
    if is_asked:
        print(f"snakewalk {version('snakewalk')}")
        raise typer.Exit


app = typer.Typer(
    cls=CommandGroup,
    no_args_is_help=True,
    rich_markup_mode="rich",
    context_settings=_CONTEXT,
    help="Run gaits on a DYNAMIXEL servo snake, or on a simulated one.",
)


@app.callback()
def _options(
    show_version: Annotated[
        bool,
        typer.Option("--version", help="print the version", is_eager=True, callback=_show_version),
    ] = False,
) -> None: ...
