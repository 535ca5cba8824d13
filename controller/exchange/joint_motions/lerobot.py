"""Joint angles of an episode of a LeRobot dataset: a folder with ``meta/info.json``.

Needs pyarrow. Versions 2.0 and 2.1 have one Parquet file for each episode; version 3.0 has several
episodes in one file.
"""

from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from snakewalk.config.archive import MOST_JSON_BYTES, parse_json, read_bytes
from snakewalk.config.arrays import Floats
from snakewalk.config.errors import InputError, first_line
from snakewalk.config.extras import require_extra
from snakewalk.config.playback import JointRequest
from snakewalk.config.reading import Fact, by_user
from snakewalk.controller.console.command import plugin
from snakewalk.controller.motion.joint_motion import (
    MOST_CELLS,
    JointMotion,
    joint_motion,
    radians,
)

_FEATURES = ("observation.state", "action")


@plugin("joints", "lerobot")
class LeRobotEpisode:
    """An episode of a LeRobot dataset."""

    def accepts(self, path: Path, head: bytes) -> bool:
        """Whether a path is the folder of a dataset."""
        return (path / "meta" / "info.json").is_file()

    def read(self, path: Path, request: JointRequest) -> JointMotion:
        """Read one episode; see ``JointReader.read``."""
        require_extra(f"{path}: LeRobot datasets need", "pyarrow")
        try:
            about = parse_json(read_bytes(path / "meta" / "info.json", MOST_JSON_BYTES))
            features = about["features"]
            rate_hz = float(about["fps"])
            episodes = int(about["total_episodes"])
            version = str(about.get("codebase_version", "not stated"))
        except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
            raise InputError(f"{path}: meta/info.json is not one of LeRobot: {error}") from None
        episode = _episode(path, request, episodes)
        feature = next((name for name in _FEATURES if name in features), None)
        if feature is None:
            raise InputError(
                f"{path}: has no {' or '.join(_FEATURES)}; it has {', '.join(features)}"
            )
        names = _names(features[feature])
        time_s, values = _rows(path, feature, episode)
        if names is None:
            names = [f"{feature}.{k}" for k in range(values.shape[1])]
        if len(names) != values.shape[1]:
            raise InputError(f"{path}: {feature}: {len(names)} names of {values.shape[1]} values")
        angles, unit = radians(
            f"{path}: {feature}",
            values,
            by_user("--unit", request.unit),
            "motors normalized to -100..100 are not angles",
        )
        if not np.isfinite(time_s).all():
            time_s = np.arange(len(values)) / rate_hz
        notes = [f"episode {episode} of {episodes}, {feature}, LeRobot {version}"]
        return joint_motion(
            path,
            time_s,
            names,
            angles,
            notes,
            unit=unit,
            time=Fact("s", "file", f"timestamp, {rate_hz:g} Hz"),
        )


def _episode(path: Path, request: JointRequest, episodes: int) -> int:
    if request.episode is None and episodes != 1:
        raise InputError(f"{path}: has {episodes} episodes; give --episode 0 to {episodes - 1}")
    episode = request.episode or 0
    if not 0 <= episode < episodes:
        raise InputError(f"--episode {episode}: {path} has episodes 0 to {episodes - 1}")
    return episode


def _names(feature: Any) -> list[str] | None:
    """Names of a feature's values: a list, or a table of one list."""
    names = feature.get("names") if isinstance(feature, dict) else None
    if isinstance(names, dict):
        names = next(iter(names.values()), None)
    return [str(name) for name in names] if isinstance(names, list) else None


def _rows(path: Path, feature: str, episode: int) -> tuple[Floats, Floats]:
    """Times (T,) and values (T, K) of an episode."""
    parquet = import_module("pyarrow.parquet")
    arrow_fault = import_module("pyarrow").ArrowException
    files = sorted((path / "data").glob(f"*/episode_{episode:06d}.parquet"))
    files = files or sorted((path / "data").glob("*/file-*.parquet"))
    times = []
    rows = []
    for file in files:
        try:
            about = parquet.read_metadata(file)
            if about.num_rows > MOST_CELLS:
                raise InputError(f"{file}: {about.num_rows} rows; at most {MOST_CELLS} are read")
            table = parquet.read_table(
                file,
                columns=["timestamp", feature],
                filters=[("episode_index", "=", episode)],
            )
            times += table["timestamp"].to_pylist()
            rows += table[feature].to_pylist()
        except (arrow_fault, KeyError, OSError, UnicodeError) as error:
            raise InputError(
                f"{file}: is not a Parquet file of LeRobot: {first_line(error)}"
            ) from None
    if not rows:
        raise InputError(f"{path}: episode {episode} has no rows in {path / 'data'}")
    try:
        values = np.array(rows, dtype=float)
        time_s = np.array([np.nan if moment is None else moment for moment in times], dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"{path}: {feature}: expected a list of numbers in each row") from None
    return time_s, values.reshape(len(values), -1)
