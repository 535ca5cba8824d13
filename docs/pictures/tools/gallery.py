"""Make a short film of each gait, as docs/gaits.md shows them."""

import argparse
from pathlib import Path
from tempfile import TemporaryDirectory

import av
from PIL import Image

from snakewalk.controller.gaits.registry import GAITS
from snakewalk.controller.report.artifacts import make_artifacts
from snakewalk.controller.run.kinds.gait_factory import prepare_gait
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.run_robot import run_robot

WIDTH, HEIGHT = 400, 225
SHOWN_S = 5.0
RUN_S = 9.0
RATE_HZ = 10


def gallery(folder: Path, names: list[str]) -> None:
    """Run each gait on the simulator and keep the last seconds of its film as a WebP."""
    folder.mkdir(parents=True, exist_ok=True)
    for name in names:
        with TemporaryDirectory() as place:
            out = Path(place)
            finished = run_robot(RunRequest(prepare_gait(name, seconds=RUN_S), out))
            made = make_artifacts(finished.record, out, finished.summary)
            if made.film is None:
                raise SystemExit(f"{name}: no film: {' '.join(made.notes)}")
            pictures = _last(made.film)
        path = folder / f"{name}.webp"
        rest = {"save_all": True, "append_images": pictures[1:], "loop": 0}
        pictures[0].save(path, duration=1000 // RATE_HZ, quality=45, method=6, **rest)
        print(f"{path}: {path.stat().st_size // 1024} kB")


def _last(film: Path) -> list[Image.Image]:
    with av.open(str(film)) as file:
        stream = file.streams.video[0]
        step = max(1, round(float(stream.average_rate or 30) / RATE_HZ))
        frames = [frame.to_image() for frame in file.decode(stream)][::step]
    count = int(SHOWN_S * RATE_HZ)
    end = len(frames) - RATE_HZ  # the last second is its coming to rest
    return [frame.resize((WIDTH, HEIGHT)) for frame in frames[max(0, end - count) : end]]


if __name__ == "__main__":
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("folder", type=Path, help="for example docs/pictures/gaits")
    options.add_argument("gait", nargs="*", help="default: all gaits")
    given = options.parse_args()
    gallery(given.folder, given.gait or list(GAITS))
