"""The command line: ``snakewalk COMMAND --help``. One line registers a command."""

import inspect
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from copy import copy
from functools import wraps
from itertools import pairwise
from typing import Annotated, Any

import typer
from typer.core import TyperCommand, TyperGroup

from snakewalk.config.errors import InputError
from snakewalk.controller.animals.commands.body import body
from snakewalk.controller.animals.commands.fish import film, match, synthesise
from snakewalk.controller.animals.commands.stride import stride
from snakewalk.controller.animals.commands.synthesise import synthesise as synthesise_walk
from snakewalk.controller.bench.commands.bus import (
    backup,
    blink,
    bus_identify,
    bus_set,
    reboot,
    restore,
    serve,
    sniff,
)
from snakewalk.controller.bench.commands.cable_drop import power
from snakewalk.controller.bench.commands.calibrate import calibrate
from snakewalk.controller.bench.commands.doctor import doctor
from snakewalk.controller.bench.commands.scan import scan
from snakewalk.controller.bench.commands.stop import stop
from snakewalk.controller.cameras.commands.board import board
from snakewalk.controller.cameras.commands.check import check
from snakewalk.controller.cameras.commands.lens import calibrate_camera
from snakewalk.controller.cameras.commands.markers import markers
from snakewalk.controller.capture.commands.analyse import analyse
from snakewalk.controller.capture.commands.capture import capture
from snakewalk.controller.capture.commands.track import track
from snakewalk.controller.console.messages import messages
from snakewalk.controller.console.options import (
    LogFile,
    LogLevel,
    Quiet,
    Verbose,
    check_files,
    check_idle,
)
from snakewalk.controller.exchange.commands.export import export
from snakewalk.controller.exchange.commands.listing import (
    export_robot,
    import_robot,
    list_,
    show_robot,
)
from snakewalk.controller.learning.commands.policy import (
    learn_policy,
    list_policies,
    policy_trials,
    run_policy,
)
from snakewalk.controller.mapping.commands.elevation import elevation
from snakewalk.controller.mapping.commands.stereo import stereo
from snakewalk.controller.repertoire.commands.crowd import crowd
from snakewalk.controller.repertoire.commands.playback import play_actions
from snakewalk.controller.repertoire.commands.repertoire import record, run_plan, show_file
from snakewalk.controller.report.commands.report import report
from snakewalk.controller.ros.commands.ros import ros
from snakewalk.controller.run.commands.gait import list_gaits, show_gait
from snakewalk.controller.run.commands.gait_fit import fit_gait
from snakewalk.controller.run.commands.gait_run import run_gait
from snakewalk.controller.run.commands.init import init
from snakewalk.controller.run.commands.plan import plan
from snakewalk.controller.run.commands.play import play
from snakewalk.controller.run.commands.run import run
from snakewalk.controller.run.commands.schema import schema
from snakewalk.controller.studies.commands.compare import compare
from snakewalk.controller.studies.commands.identify import identify
from snakewalk.controller.studies.commands.replay import replay
from snakewalk.controller.studies.commands.shadow import shadow
from snakewalk.controller.studies.commands.sweep import sweep
from snakewalk.controller.studies.commands.trials import trials
from snakewalk.controller.studies.commands.tune import tune
from snakewalk.controller.studies.commands.walk import walk
from snakewalk.controller.view.commands.view import view

_JOB, _MOTION, _RECORDINGS, _BUS = "The job", "Motion", "Recordings", "The bus"
"""Groups of the commands in ``--help``."""


class _Commands(TyperGroup):
    """The commands; an interrupt ends each with exit code 130 and a line.

    A command's options are built when it is asked for: to build those of all, and what draws
    typer's boxes, costs more than a short command does.
    """

    whole: dict[str, Callable[[], Any]]
    """What builds each command; until then it has its first line only."""

    def get_command(self, ctx: Any, cmd_name: str) -> Any:
        """Return a command with its options."""
        build = self.whole.get(cmd_name)
        return super().get_command(ctx, cmd_name) if build is None else build()

    def format_help(self, ctx: Any, formatter: Any) -> None:
        """Print the list of commands, for which their first lines do."""
        listed = copy(self)
        listed.whole = {}
        TyperGroup.format_help(listed, ctx, formatter)

    def make_context(self, info_name: Any, args: list[str], *more: Any, **options: Any) -> Any:
        """Read the words before a command's name; an empty one would be the folder of now."""
        with _faults_in_one_line():
            for before, word in pairwise([self.name or "snakewalk", *args]):
                name = before if word == "" else word.removesuffix("=")
                if word == "" or (word.startswith("--") and name != word):
                    raise typer.BadParameter(f"nothing after {name}: fill it, or leave it out")
            return super().make_context(info_name, args, *more, **options)

    def invoke(self, ctx: Any) -> Any:
        """Run a command; print what an interrupt's notes say of torque and log."""
        try:
            with _faults_in_one_line():
                return super().invoke(ctx)
        except KeyboardInterrupt as stop:
            text = "; ".join(["interrupted", *getattr(stop, "__notes__", [])])
            print(f"snakewalk: {text}", file=sys.stderr)
            raise SystemExit(130) from None


class _Command(TyperCommand):
    """A command that refuses a value which would replace another one of the same option."""

    def parse_args(self, ctx: Any, args: list[str]) -> Any:
        """Read the words behind a command's name."""
        words = list(args)
        rest = super().parse_args(ctx, args)  # --help ends here
        if not ctx.resilient_parsing:  # of completion
            order: list[Any] = self.make_parser(ctx).parse_args(words)[2]
            for option in dict.fromkeys(order):
                if order.count(option) > 1 and _takes_one_value(option):
                    told = f"given {order.count(option)} times, and takes one value: leave one"
                    raise typer.BadParameter(told, ctx=ctx, param=option)
        return rest


def _takes_one_value(option: Any) -> bool:
    """Whether a second value of an option replaces the first; a flag that only sets does not."""
    return not (option.multiple or (option.is_flag and not option.secondary_opts))


@contextmanager
def _faults_in_one_line() -> Iterator[None]:
    """Have typer print what is wrong with a command's words in one line, in place of its box."""
    try:
        yield
    except Exception as error:
        if hasattr(error, "format_message"):  # one of typer's
            from typer import rich_utils  # noqa: PLC0415  slow, and only --help and these need it

            rich_utils.rich_format_error = _in_one_line  # type: ignore[assignment]
        raise


def _in_one_line(error: Any) -> None:
    if type(error).__name__ == "NoArgsIsHelpError":  # its help has been shown
        return
    context = getattr(error, "ctx", None)
    path = "snakewalk" if context is None else context.command_path
    text = " ".join(error.format_message().split()).replace(": Value error, ", ": ")  # pydantic's
    print(f"snakewalk: {text} (see {path} --help)", file=sys.stderr)


def _with_messages(function: Callable[..., Any]) -> Callable[..., Any]:
    """Give a command the options of what it says, and check the files that it names first.

    Faults in these files are told before anything heavy is imported.
    """
    signature = inspect.signature(function, eval_str=True)
    defaults = {name: one.default for name, one in signature.parameters.items()}

    @wraps(function)
    def command(
        *, verbose: Verbose, quiet: Quiet, log_level: LogLevel, log_file: LogFile, **options: Any
    ) -> Any:
        if (log_level is not None) + verbose + quiet > 1:
            raise InputError("--verbose, --quiet and --log-level say the same thing: leave one")
        check_idle(options, defaults)
        level = log_level or ("debug" if verbose else "warning" if quiet else "info")
        with messages(level, log_file):
            named = {key: value for key, value in options.items() if isinstance(value, str)}
            check_files(named.get("run"), named.get("robot"), named.get("world"))
            return function(**options)

    own = [
        inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=kind)
        for name, kind, default in (
            ("verbose", Verbose, False),
            ("quiet", Quiet, False),
            ("log_level", LogLevel, None),
            ("log_file", LogFile, None),
        )
    ]
    paragraphs = (inspect.getdoc(function) or "").split("\n\n")
    command.__doc__ = "\n\n".join(" ".join(each.split()) for each in paragraphs)
    command.__annotations__ = function.__annotations__ | {one.name: one.annotation for one in own}
    command.__signature__ = signature.replace(  # type: ignore[attr-defined]
        parameters=[*signature.parameters.values(), *own]
    )
    return command


class _App(typer.Typer):
    """Commands that say how they get on, each built when it is asked for."""

    def __init__(self, **options: Any) -> None:
        self._whole: dict[str, Callable[[], Any]] = {}
        commands = type("_CommandsOfApp", (_Commands,), {"whole": self._whole})
        super().__init__(cls=commands, **options)

    def command(self, name: str | None = None, **options: Any) -> Any:
        """Register a command."""

        def register(function: Callable[..., Any]) -> Callable[..., Any]:
            def listed() -> None: ...

            listed.__doc__ = function.__doc__
            own_name = name or function.__name__.replace("_", "-")
            self._whole[own_name] = lambda: _whole(own_name, function, options)
            super(_App, self).command(own_name, **options)(listed)
            return function

        return register


def _whole(name: str, function: Callable[..., Any], options: dict[str, Any]) -> Any:
    """Build a command with its options."""
    alone = typer.Typer(add_completion=False, rich_markup_mode="rich")
    alone.command(name, cls=_Command, **options)(_with_messages(function))
    return typer.main.get_command(alone)


app = _App(
    no_args_is_help=True,
    rich_markup_mode="rich",
    context_settings={"help_option_names": ["-h", "--help"]},
    help="Run gaits on a DYNAMIXEL servo snake, or on a simulated one that answers the same bytes.",
)


def _show_version(asked: bool) -> None:
    if asked:
        from importlib.metadata import version  # noqa: PLC0415  --help stays quick

        print(f"snakewalk {version('snakewalk')}")
        raise typer.Exit


@app.callback()
def _options(
    show_version: Annotated[
        bool,
        typer.Option("--version", help="show it", is_eager=True, callback=_show_version),
    ] = False,
) -> None:
    """Take the options before a command."""


def _examples(*lines: str) -> str:
    return "\n\n".join(["Examples:", *(f"[bold]snakewalk {line}[/bold]" for line in lines)])


app.command("list", epilog=_examples("list --json"), rich_help_panel=_JOB)(list_)

app.command(
    epilog=_examples("init mine", "init mine --robot xl330-16", "init mine --from ramp-10-up"),
    rich_help_panel=_JOB,
)(init)

app.command(epilog=_examples("schema run", "schema robot -o robot.json"), rich_help_panel=_JOB)(
    schema
)

app.command(
    epilog=_examples(
        "plan",
        "plan flat-slalom --motion serpenoid --json",
        "plan flat-slalom --with repertoire -o plan.json --run",
    ),
    rich_help_panel=_JOB,
)(plan)

app.command(
    epilog=_examples("run", "run flat-slalom --seed 3", "run my-run.toml --port /dev/ttyUSB0"),
    rich_help_panel=_JOB,
)(run)

app.command(
    epilog=_examples("stop", "stop --port /dev/ttyUSB0 --json", "stop runs/flat-square-walk-seed0"),
    rich_help_panel=_JOB,
)(stop)

app.command(
    epilog=_examples(
        "ros",
        "ros --robot my.toml --port /dev/ttyUSB0 --domain 7 --namespace snake",
        "ros --robot alternating16 --gait rolling --network",
    ),
    rich_help_panel=_JOB,
)(ros)

app.command(
    epilog=_examples("view runs/flat-square-walk-seed0/log.mcap", "gait run sidewinding --view"),
    rich_help_panel=_JOB,
)(view)

app.command(epilog=_examples("report runs/flat-square-walk-seed0/log.mcap"), rich_help_panel=_JOB)(
    report
)

app.command(
    epilog=_examples("replay runs/flat-square-walk-seed0/log.mcap --json"), rich_help_panel=_JOB
)(replay)
app.command(
    epilog=_examples(
        "shadow runs/gait-lateral-undulation-yaw16/log.mcap",
        "gait run lateral-undulation --port /dev/ttyUSB0 --shadow",
    ),
    rich_help_panel=_JOB,
)(shadow)

app.command(
    epilog=_examples(
        "identify kp200.json kp800.json -o xl330.json",
        "identify kp200.json kp800.json --robot xl330-16 --robot-out mine.toml",
        "identify kp400.json --start xl330.json --no-fit --json",
        "identify runs/flat-slalom-walk-seed0/log.mcap -o found.toml",
        "identify runs/NAME/log.mcap -o found.toml --robot-out mine.toml",
    ),
    rich_help_panel=_BUS,
)(identify)

app.command(
    epilog=_examples(
        "export runs/flat-square-walk-seed0/log.mcap --csv tables",
        "export LOG --parquet tables --foxglove body.mcap",
        "export LOG --ros2 bag.mcap --json",
    ),
    rich_help_panel=_JOB,
)(export)

app.command(
    epilog=_examples(
        "compare runs/flat-square-walk-seed0/log.mcap runs/flat-square-walk-seed1/log.mcap",
        "compare runs/*/log.mcap --picture compared.png --json",
    ),
    rich_help_panel=_JOB,
)(compare)

app.command(
    epilog=_examples(
        "sweep sidewinding rolling --points 30 -o sweep.csv --picture sweep.png",
        "sweep --dask tcp://cluster:8786 --points 500",
    ),
    rich_help_panel=_MOTION,
)(sweep)

app.command(
    epilog=_examples("tune sidewinding --for speed --out mine.toml", "gait run mine.toml"),
    rich_help_panel=_MOTION,
)(tune)

app.command(
    epilog=_examples("trials flat-slalom --seeds 10 --motion walk --motion serpenoid --json"),
    rich_help_panel=_JOB,
)(trials)

app.command(
    "synthesise",
    epilog=_examples(
        "synthesise -o motion",
        "synthesise my-run.toml --seed 3 --json",
        "synthesise jacksboro-traverse --animal lizard -o lizard --film",
    ),
    rich_help_panel=_MOTION,
)(synthesise_walk)

app.command(
    epilog=_examples(
        "stride TRACKED.h5 --spine nose,neck,hip,tail --girdles neck,hip "
        "--feet FL,FR,HL,HR -o mine.toml --picture stride.png",
        "synthesise jacksboro-traverse --animal mine.toml --film",
    ),
    rich_help_panel=_RECORDINGS,
)(stride)

app.command(
    epilog=_examples("track", "track MIDLINES.csv --rate 60 --picture track.png"),
    rich_help_panel=_RECORDINGS,
)(track)

app.command(
    epilog=_examples("analyse worm-like", "analyse MIDLINES.csv --picture ."),
    rich_help_panel=_RECORDINGS,
)(analyse)

app.command(
    epilog=_examples("body worm-like -o worm.glb", "body TRACK.npz --image 0.png -o b.obj"),
    rich_help_panel=_RECORDINGS,
)(body)

app.command(
    epilog=_examples(
        "capture film.mp4 -o track.npz --length-m 0.4 --sheet sheet.png",
        "capture frames/ --cropped --overlay overlay.mp4 --force --json",
        "capture film.mp4 --review review.html",
        "capture track.npz --corrections track-corrections.json -o corrected.npz",
    ),
    rich_help_panel=_RECORDINGS,
)(capture)

app.command(
    epilog=_examples(
        "walk", "walk --graph er:1000:9 --rule snake --rule stack --repeats 30 --json"
    ),
    rich_help_panel=_MOTION,
)(walk)

app.command(
    epilog=_examples("scan", "scan --port /dev/ttyUSB0 --baud 57600 --json"), rich_help_panel=_BUS
)(scan)

app.command(
    epilog=_examples("doctor", "doctor --port /dev/ttyUSB0 --robot alternating16"),
    rich_help_panel=_BUS,
)(doctor)

app.command(
    epilog=_examples("calibrate --robot alternating16 -o my-robot.toml"), rich_help_panel=_BUS
)(calibrate)

bus = _App(no_args_is_help=True, help="Servos and their settings.")

app.add_typer(bus, name="bus", rich_help_panel=_BUS)

bus.command(
    "set",
    epilog=_examples(
        "bus set --id 1 --baud 57600 --new-id 7 --new-baud 1000000 --dry-run",
        "bus set --id 7 --return-delay 0 --yes",
    ),
)(bus_set)

bus.command(
    epilog=_examples(
        "bus serve --servos 1-16", "bus serve --robot yaw16 --faults faults.toml --pace 0.5"
    )
)(serve)

bus.command(epilog=_examples("bus backup -o servos.json", "bus backup --baud 57600 -o one.json"))(
    backup
)

bus.command(
    epilog=_examples("bus restore servos.json --dry-run", "bus restore servos.json --id 7 --yes")
)(restore)

bus.command(epilog=_examples("bus reboot --id 3 --id 4"))(reboot)

bus.command(epilog=_examples("bus blink --id 7 --times 10"))(blink)

bus.command(
    "identify", epilog=_examples("bus identify", "bus identify --baud 1000000 -o mine.toml")
)(bus_identify)

bus.command(epilog=_examples("bus sniff exchange.jsonl --json", "bus sniff /dev/ttyUSB1"))(sniff)

app.command(
    epilog=_examples("play worm-like", "play fish.npz --robot yaw16 --speed 0.5 --json"),
    rich_help_panel=_MOTION,
)(play)

gait_app = _App(no_args_is_help=True, help="Gaits: list, show, run, fit.")

app.add_typer(gait_app, name="gait", rich_help_panel=_MOTION)

gait_app.command("list", epilog=_examples("gait list --json"))(list_gaits)

gait_app.command(
    "show", epilog=_examples("gait show sidewinding", "gait show rolling --picture rolling.png")
)(show_gait)

gait_app.command(
    "run",
    epilog=_examples(
        "gait run sidewinding --param lift_rad=0.15 --seconds 10",
        "gait run lateral-undulation --robot yaw16 --live",
        "gait run rolling --port /dev/ttyUSB0",
    ),
)(run_gait)

gait_app.command(
    "fit",
    epilog=_examples("gait fit CURVE.csv --picture fit.png", "gait fit CURVE.csv -o joints.npz"),
)(fit_gait)

policy_app = _App(no_args_is_help=True, help="Learnt policies: list, run, compare, learn.")

app.add_typer(policy_app, name="policy", rich_help_panel=_MOTION)

policy_app.command("list", epilog=_examples("policy list --json"))(list_policies)

policy_app.command(
    "run",
    epilog=_examples(
        "policy run wave-cma --seconds 10",
        "policy run mine.toml --set world.friction.across=0.3 --json",
        "policy run wave-ppo --port /dev/ttyUSB0",
    ),
)(run_policy)

policy_app.command(
    "learn",
    epilog=_examples("policy learn -o mine.toml", "policy learn --seed 1 --workers 8 -o one.toml"),
)(learn_policy)

policy_app.command(
    "trials",
    epilog=_examples(
        "policy trials wave-cma wave-ppo lateral-undulation --first-seed 1000",
        "policy trials mine.toml wave-cma --world flat --world flat-friction-3 --json",
    ),
)(policy_trials)

robot_app = _App(no_args_is_help=True, help="A robot: show it, its power, export it, import one.")

app.add_typer(robot_app, name="robot", rich_help_panel=_JOB)

robot_app.command("show", epilog=_examples("robot show alternating16", "robot show my.toml"))(
    show_robot
)

robot_app.command(
    "power", epilog=_examples("robot power alternating16", "robot power my.toml --current 0.5")
)(power)

robot_app.command(
    "export", epilog=_examples("robot export yaw16 --urdf yaw16.urdf --mjcf yaw16.xml")
)(export_robot)

robot_app.command(
    "import",
    epilog=_examples(
        "robot import snake.urdf -o snake.toml",
        "robot import swimmer.xml -o swimmer.toml --scale 0.1 --servo XL330-M288",
    ),
)(import_robot)

terrain_app = _App(
    no_args_is_help=True, help="Worlds from real ground: maps of files, and of stereo."
)

app.add_typer(terrain_app, name="terrain", rich_help_panel=_JOB)

terrain_app.command(
    "from",
    epilog=_examples(
        "terrain from dem.tif --scale 0.002 -o hill.toml --picture hill.png",
        "terrain from scan.pcd --crop 20,50,80,150 --scale 0.05 --fill 0.3 -o slope.toml",
        "terrain from heights.png --cell 0.05 --height-step 0.001 -o garden.toml",
    ),
)(elevation)

terrain_app.command(
    "from-stereo",
    epilog=_examples(
        "terrain from-stereo left.png right.png --calibration stereo.yml -o yard.toml",
        "terrain from-stereo l.png r.png --calibration c.yml --height 0.5 --tilt 30 -o yard.toml",
    ),
)(stereo)

camera_app = _App(no_args_is_help=True, help="The camera above the robot: lens, markers, check.")

app.add_typer(camera_app, name="camera", rich_help_panel=_JOB)

camera_app.command(
    epilog=_examples(
        "camera board -o board.pdf", "camera board -o a3.pdf --squares 9x6 --square 42"
    )
)(board)

camera_app.command(
    "calibrate",
    epilog=_examples(
        "camera calibrate pictures -o lens.yml", "camera calibrate 0 -o lens.yml --size 1280x720"
    ),
)(calibrate_camera)

camera_app.command(
    epilog=_examples(
        "camera markers -o markers.pdf", "camera markers -o a3.pdf --side 250 --count 4"
    )
)(markers)

camera_app.command(
    epilog=_examples(
        "camera check flat-square", "camera check my-run.toml --port /dev/ttyUSB0 --view"
    )
)(check)

fish_app = _App(no_args_is_help=True, help="Fish from video: match, synthesise, film.")

app.add_typer(fish_app, name="fish", rich_help_panel=_RECORDINGS)

fish_app.command(
    epilog=_examples(
        "fish match top.mp4 --side side.mp4 -o postures.npz",
        "fish match tank/top --background tank/top-background.png --picture match.png",
    )
)(match)

fish_app.command(
    epilog=_examples(
        "fish synthesise postures.npz --seconds 30 --seed 1 -o track.npz",
        "fish synthesise postures.npz --through 3,0 --through 5,3 --mirror",
    )
)(synthesise)

fish_app.command(
    epilog=_examples("fish film tank --side", "fish film eel --motion MIDLINES.csv --build eel")
)(film)

repertoire = _App(no_args_is_help=True, help="Actions recorded from the physics.")

app.add_typer(repertoire, name="repertoire", rich_help_panel=_MOTION)

repertoire.command(
    "record", epilog=_examples("repertoire record", "repertoire record -o yaw16.npz --json")
)(record)

repertoire.command("show", epilog=_examples("repertoire show repertoire-yaw16-flat.npz"))(show_file)

repertoire.command(
    "play",
    epilog=_examples(
        "repertoire play --speed 0.6 --turn 0.3",
        "repertoire play repertoire-yaw16-flat.npz --schedule wanted.toml --picture wanted.png",
    ),
)(play_actions)
repertoire.command(
    "crowd", epilog=_examples("repertoire crowd", "repertoire crowd --bodies 300 -o herd.mp4")
)(crowd)
repertoire.command(
    "run",
    epilog=_examples("repertoire run plan.json", "repertoire run plan.json --open-loop --json"),
)(run_plan)
