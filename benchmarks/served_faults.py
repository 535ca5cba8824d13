"""``python -m benchmarks.served_faults``: faults of processes, terminals and disks.

Each scenario serves four simulated servos at a pseudo-terminal in real time, starts a command on
them, and does something to one of the two while the servos have torque. A full disk is a small
tmpfs, which needs the rights to mount it. The pages' tables are replaced.
"""

import argparse
import json
import os
import re
import shutil
import signal
import subprocess
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks.provenance import provenance, write_tables
from benchmarks.served_bus import LONGEST_S, PROGRAM, Served, wait_for
from benchmarks.stopped_calibrations import STOPS, stopped_calibration

IN_MOTION_S = 5.0
"""Time from torque to the fault: the ramp of the start is over."""


@dataclass
class Run:
    """A command that moves the served servos."""

    folder: Path
    served: Served
    process: subprocess.Popen[str]

    def children(self) -> list[int]:
        """Process IDs of the observers."""
        text = Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children").read_text()
        return [int(each) for each in text.split()]

    def signal_children(self, number: signal.Signals) -> None:
        """Send a signal to each observer."""
        for child in self.children():
            os.kill(child, number)

    def fill(self, folder: str) -> None:
        """Fill a disk."""
        with open(self.folder / folder / "filler", "wb", buffering=0) as file:
            try:
                while file.write(bytes(1024)):
                    pass
            except OSError:
                return


Action = Callable[[Run], object]
RUN_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGKILL)


def _ends_after_stop(run: Run) -> None:
    subprocess.run([PROGRAM, "stop", "--port", "port"], cwd=run.folder, check=False)


def _pause(run: Run) -> None:
    run.process.send_signal(signal.SIGSTOP)
    time.sleep(1.2)
    run.process.send_signal(signal.SIGCONT)


def _twice(run: Run) -> None:
    run.process.send_signal(signal.SIGINT)
    time.sleep(1.5)
    run.process.send_signal(signal.SIGINT)


def _relink(run: Run) -> None:
    run.served.port.unlink()
    run.served.port.symlink_to("/dev/null")


def _sends(number: signal.Signals) -> Action:
    return lambda run: run.process.send_signal(number)


SHADOW, PAGE = ("--shadow",), ("--view", "--view-at", "127.0.0.1:0")
PAD, ROS, DISK = ("--gamepad", "pad"), ("--ros",), ("--out", "disk/run")
RUNS: dict[str, tuple[tuple[str, ...], Action]] = {
    **{
        f"{number.name} during `--shadow`": (
            SHADOW,
            _sends(number),
        )
        for number in RUN_SIGNALS
    },
    "SIGINT twice within 1.5 s during `--shadow`": (SHADOW, _twice),
    "`snakewalk stop` during `--shadow`": (SHADOW, _ends_after_stop),
    "SIGSTOP for 1.2 s during `--shadow`": (SHADOW, _pause),
    "server killed during `--shadow`": (SHADOW, lambda run: run.served.process.kill()),
    "servo 2 mute during `--shadow`": (SHADOW, lambda run: run.served.say("fault mute ids=[2]")),
    "Goal PWM of servo 2 = 300 during `--shadow`": (
        SHADOW,
        lambda run: run.served.say("set 2 Goal PWM 300"),
    ),
    "`drop` of all replies for 1.5 s, policy resume, during `--shadow`": (
        (*SHADOW, "--set", 'run.safety.recovery="resume"'),
        lambda run: run.served.say("fault drop for_s=1.5"),
    ),
    "process of the page killed": (PAGE, lambda run: run.signal_children(signal.SIGKILL)),
    "process of the page stopped": (PAGE, lambda run: run.signal_children(signal.SIGSTOP)),
    "process of the ROS node killed": (ROS, lambda run: run.signal_children(signal.SIGKILL)),
    "process of the ROS node stopped": (ROS, lambda run: run.signal_children(signal.SIGSTOP)),
    "program that writes to the gamepad's pipe ends": (PAD, lambda run: None),
    "disk of the run full": (DISK, lambda run: run.fill("disk")),
    "disk of `--log-file` full": (("--verbose", "--log-file", "/dev/full"), lambda run: None),
    "folder of the run deleted": ((), lambda run: shutil.rmtree(run.folder / "run")),
    "folder of the run moved": ((), lambda run: (run.folder / "run").rename(run.folder / "new")),
    "link of the server deleted": ((), lambda run: run.served.port.unlink()),
    "link of the server leads elsewhere": ((), _relink),
}


def played(name: str) -> str:
    """Play a scenario; returns its row."""
    options, act = RUNS[name]
    with TemporaryDirectory() as temporary:
        folder = Path(temporary)
        needs_disk = any("disk/" in each for each in options)
        if needs_disk:
            (folder / "disk").mkdir()
            mount = ["mount", "-t", "tmpfs", "-o", "size=400k", "tmpfs", str(folder / "disk")]
            subprocess.run(mount, check=True)
        served = Served(folder)
        try:
            return _row(name, options, act, folder, served)
        finally:
            served.end()
            if needs_disk:
                subprocess.run(["umount", str(folder / "disk")], check=True)


def _row(name: str, options: tuple[str, ...], act: Action, folder: Path, served: Served) -> str:
    pad = None
    if options == PAD:
        os.mkfifo(folder / "pad")
        pad = os.open(folder / "pad", os.O_RDWR)
        os.write(pad, bytes(6) + b"\x81\x04")  # a shoulder button, as it is at the start
    words = ["gait", "run", "lateral-undulation", "--robot", "robot.toml", "--port", "port"]
    # a program that is started on a busy machine to stop the run needs many seconds
    seconds = "60" if act is _ends_after_stop else "10"
    words += ["--seconds", seconds, "--no-film", "--json", *options]
    if "--out" not in options:
        words += ["--out", "run"]
    with (folder / "out.txt").open("w+") as out, (folder / "err.txt").open("w+") as err:
        process = subprocess.Popen(
            [PROGRAM, *words], cwd=folder, text=True, start_new_session=True,
            stdin=subprocess.DEVNULL, stdout=out, stderr=err,
        )  # fmt: skip
        wait_for(lambda: process.poll() is not None or served.torque() == "on")
        if process.poll() is None:
            time.sleep(IN_MOTION_S)
            act(Run(folder, served, process))
            if pad is not None:
                os.close(pad)
        code: int | str
        try:
            code = process.wait(LONGEST_S)
        except subprocess.TimeoutExpired:
            process.kill()
            code = "does not end"
        printed, said = (folder / "out.txt").read_text(), (folder / "err.txt").read_text()
    time.sleep(2.0)  # the bus watchdogs
    if "Traceback" in said:
        code = f"{code}, traceback"
    return f"| {name} | {code} | {_reason(printed, said, served)} | {served.torque()} |"


def _reason(printed: str, said: str, served: Served) -> str:
    """Return the trip of the summary; without one, the last message of run and server."""
    try:
        text = json.loads(printed).get("tripped") or ""
    except ValueError:
        text = ""
    lines = [*served.warnings(), *said.splitlines()]
    lines = [line.removeprefix("snakewalk: ") for line in lines if line.startswith("snakewalk: ")]
    lines = [line for line in lines if not line.startswith(("log: ", "pose: "))]
    text = text or (lines[-1] if lines else "")
    text = text.replace(f"{served.port.parent}/", "").replace("|", "/")
    text = re.sub(r"/dev/pts/\d+", "/dev/pts/N", text)
    return re.sub(r"; (log|its page|the run up to there): .*| \(process \d+\)", "", text) or "-"


def main() -> None:
    """Play all scenarios and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--workers", type=int, default=1, help="scenarios at the same time")
    parser.add_argument("--only", default="", help="scenarios that match; changes no page")
    given = parser.parse_args()
    names = [name for name in RUNS if re.search(given.only, name)]
    stops = [name for name in STOPS if re.search(given.only, name)]
    with ThreadPoolExecutor(given.workers) as pool:
        runs = list(pool.map(played, names))
        calibrations = list(pool.map(stopped_calibration, stops))
    lines = [
        *(provenance("python -m benchmarks.served_faults"), ""),
        "| fault | exit code | message | torque |",
        *("| --- | ---: | --- | --- |", *runs, ""),
        "| `bus calibrate` ends by | exit code | torque | answers before | asked again | result |",
        *("| --- | ---: | --- | ---: | ---: | --- |", *calibrations),
    ]
    print(*lines, sep="\n")
    if not given.only:
        write_tables("bus-faults", "served faults", "\n".join(lines))


if __name__ == "__main__":
    main()
