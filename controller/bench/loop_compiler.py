"""Compile every loop in advance, in two child processes.

Importing a module compiles its loops; numba stores the machine code next to the module.
"""

import importlib
import importlib.util
import pkgutil
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import IO

from snakewalk.config.loader import load_robot, load_world
from snakewalk.controller.console.child_process import start_module
from snakewalk.controller.console.imports import without_collections
from snakewalk.controller.console.messages import LOGGER
from snakewalk.controller.console.progress import ProgressBar
from snakewalk.drivers.compilation import observe_compilation
from snakewalk.drivers.fallbacks import fallbacks_in_use

ALL = (("drivers", "sim"), ("controller",))
"""Packages of each child for all loops: they compile about equally long, and no loop of both."""
FOR_RUNS = (
    ("drivers", "sim"),
    tuple(
        f"controller.{name}"
        for name in (
            *("kinematics", "mechanics", "shape", "terrain", "gaits", "motion", "runlog", "walk"),
            *("runtime", "track", "pose", "metrics", "run"),
        )
    ),
)
"""Packages of each child whose loops a run in the simulator needs: about half of the work."""
_COMPILING_MODULE = "snakewalk.drivers.compiling"
"""A module with a loop imports its decorator from here."""


def loop_modules(package: str) -> list[str]:
    """Names of the modules of a package with a loop; imports none."""
    modules: list[str] = []
    folder = Path(__file__).resolve().parents[2]
    for part in package.split(".")[1:]:
        folder /= part
    for module_info in pkgutil.iter_modules([str(folder)], f"{package}."):
        if module_info.ispkg:
            modules += loop_modules(module_info.name)
            continue
        file = folder / f"{module_info.name.rpartition('.')[2]}.py"
        if file.exists() and f"from {_COMPILING_MODULE} import" in file.read_text(encoding="utf-8"):
            modules.append(module_info.name)
    return modules


def compile_with_progress(*, runs: bool) -> int:
    """Compile all loops, or only those of ``runs``, with a progress bar; return their number."""
    with ProgressBar("compiling loops") as bar:
        return compile_loops(
            lambda done, total, name: bar.update(done, total, note=name.split(".")[2]),
            FOR_RUNS if runs else ALL,
        )


def compile_loops(
    on_module: Callable[[int, int, str], None], shares: tuple[tuple[str, ...], ...]
) -> int:
    """Compile loops and return the number that was not in the cache.

    Args:
        on_module: called with the number of finished modules, their total, and a name.
        shares: packages of each child process.

    Raises:
        RuntimeError: a child failed; its output is above.

    """
    total = sum(len(loop_modules(f"snakewalk.{package}")) for share in shares for package in share)
    lock = threading.Lock()
    notes: dict[str, None] = {}  # of both children, in the order of arrival
    done = 0
    compiled = 0
    children = [start_module(__name__, *share) for share in shares]

    def follow(lines: IO[str] | None) -> None:
        nonlocal done, compiled
        for line in lines or ():
            kind, _, name = line.strip().partition(" ")
            with lock:
                compiled += kind == "loop"
                done += kind == "module"
                if kind == "note":
                    notes[name] = None
                else:
                    on_module(min(done, total), total, name)

    threads = [
        threading.Thread(target=follow, args=(child.stdout,), daemon=True) for child in children
    ]
    for thread in threads:
        thread.start()
    try:
        codes = [child.wait() for child in children]
        for thread in threads:
            thread.join()
    finally:
        for child in children:
            child.kill()
    for note in notes:
        LOGGER.warning("%s", note)
    if any(codes):
        raise RuntimeError("a loop was not compiled; the reason is above")
    return compiled


def _step_a_body() -> None:
    """Compile the physics' steps, whose types are MuJoCo's, by a first call."""
    if importlib.util.find_spec("mujoco") is None:
        return
    plant = importlib.import_module("snakewalk.sim.physics.plant")
    motor = importlib.import_module("snakewalk.sim.servo.motor")
    robot = load_robot("yaw16")
    body = plant.MujocoPlant(robot, load_world("flat"), None, 0.002)
    drive = motor.make_drive([motor.MOTORS[model] for model in robot.servo_models], 12.0)
    body.advance(0.002, drive)


def _compile_share(packages: list[str]) -> None:
    """In a child: import the modules, and print a line per module and compiled loop."""
    observe_compilation(lambda loop: print("loop", loop, flush=True))
    for package in packages:
        for name in loop_modules(f"snakewalk.{package}"):
            try:
                with without_collections():
                    importlib.import_module(name)
            except ModuleNotFoundError as error:
                if (error.name or "").startswith("snakewalk"):
                    raise
                # a package of an extra is not installed; its commands are not available either
            print("module", name, flush=True)
    if "sim" in packages:
        with without_collections():
            _step_a_body()
    for note in fallbacks_in_use():
        print("note", note, flush=True)


if __name__ == "__main__":
    _compile_share(sys.argv[1:])
