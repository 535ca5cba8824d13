"""Small valid files of every reader, and the function that reads each."""

import bz2
import gzip
import lzma
import shutil
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any, Final

import cv2
import numpy as np

from snakewalk.config.loader import load_gait, load_robot, load_run, load_world
from snakewalk.config.playback import JointRequest
from snakewalk.controller.exchange.robot_import.robot_choice import RobotChoice
from snakewalk.controller.exchange.robot_import.robot_import import import_robot
from snakewalk.controller.images.video import open_footage
from snakewalk.controller.mapping.elevation_choice import CalibrationChoice, ElevationChoice
from snakewalk.controller.mapping.elevation_file import MapOptions, read_elevation
from snakewalk.controller.mapping.stereo_camera import read_calibration
from snakewalk.controller.run.kinds.playback_run import foreign_joints
from snakewalk.controller.track.choice import Choice
from snakewalk.controller.track.readers.load import load_file
from tests.controller.mapping.test_las_file import write as las
from tests.foreign.case import Case
from tests.foreign.every import every_case
from tests.foreign.grounds import FAR_M, POINTS, solid
from tests.foreign.motions import ROBOT, bags, table
from tests.foreign.tracks import midlines

Options = dict[str, Any]
ROOT: Final = Path(__file__).resolve().parents[3]


def read_joints(file: Path, options: Options) -> None:
    foreign_joints(str(file), ROBOT, JointRequest(**options))


def read_track(file: Path, options: Options) -> None:
    load_file(file, choice=Choice(**options))


def read_ground(file: Path, options: Options) -> None:
    given = dict(options)
    spacing_m = given.pop("spacing_m", None)
    read_elevation(file, MapOptions(ElevationChoice(**given), spacing_m=spacing_m))


def read_model(file: Path, options: Options) -> None:
    import_robot(file, "model", "XM430-W350", RobotChoice(**options))


def read_stereo(file: Path, options: Options) -> None:
    read_calibration(file, CalibrationChoice(**options))


def read_film(file: Path, options: Options) -> None:
    for _ in open_footage(file, **options).timed():
        pass


def loads(load: Callable[[str], object]) -> Callable[[Path, Options], None]:
    return lambda file, _: void(load(str(file)))


def void(_: object) -> None:
    """Drop a result."""


READS: Final[dict[str, Callable[[Path, Options], None]]] = {
    **dict.fromkeys(("joints", "lerobot"), read_joints),
    **dict.fromkeys(("midlines", "wcon", "tierpsy", "tracker", "qtm", "vicon", "trc", "motive",
                     "c3d", "bvh", "arrays"), read_track),
    **dict.fromkeys(("geotiff", "grid", "points", "las", "raster"), read_ground),
    **dict.fromkeys(("urdf", "mjcf", "sdf"), read_model),
    "calibration": read_stereo,
}  # fmt: skip
"""Reader of each kind of generated files."""


@dataclass(frozen=True)
class Target:
    """A valid file and its reader."""

    name: str
    write: Callable[[Path], Path]
    read: Callable[[Path, Options], None]
    options: Options = field(default_factory=dict)


def target_of(case: Case) -> Target:
    """Return a generated file as a target."""
    options = dict(case.options)
    if case.kind == "tierpsy":
        options["individual"] = "2"
    return Target(case.name, case.write, READS[case.kind], options)


@cache
def readable() -> dict[str, Target]:
    """All generated files that are read without a question or with its answer, by their names."""
    return {c.name: target_of(c) for c in every_case() if not isinstance(c.answer, str)}


CHOSEN: Final = (
    "joints: angles_deg, times time_s", "joints: bag, stamps from 7 s",
    "joints: bag, one trajectory", "lerobot: v2.1, --unit rad", "lerobot: v3.0, --unit rad",
    "midlines: columns x_m", "wcon: one record with lists",
    "tierpsy: features, all stated", "tierpsy: skeletons, all stated",
    "tracker: DeepLabCut CSV, --rate", "tracker: DeepLabCut HDF5, --rate",
    "tracker: SLEAP analysis, --rate", "qtm: --rate", "vicon: --rate", "trc: --rate",
    "motive: --rate", "c3d: unit mm", "bvh: all stated but the length",
    "arrays: npz, all stated", "arrays: mat, 50 Hz",
    "geotiff: heights in m", "grid: NODATA_value -9999", "points: no names",
    "points: names x y z", "points: mesh a.obj", "points: mesh a.stl", "points: mesh a.ply",
    "points: mesh a.glb, y up by glTF", "points: cloud a.ply", "points: cloud a.pcd",
    "las: a system in metres", "las: keys of a system in metres",
    "raster: a.csv, --cell", "raster: a.npz, --cell", "raster: a picture, --height-step",
    "urdf: all stated", "mjcf: degrees", "sdf: version 1.9",
    "calibration: yml, K1, T in m", "calibration: xml, K1, T in m",
    "calibration: json, K1, T in m", "calibration: npz, K1, T in m",
    "calibration: Middlebury, baseline in mm",
)  # fmt: skip
"""Generated files of which each stands for a reader."""


def packed(pack: Any, ending: str, write: Callable[[Path], Path]) -> Callable[[Path], Path]:
    def write_packed(folder: Path) -> Path:
        plain = write(folder)
        file = plain.with_name(f"{plain.name}.{ending}")
        file.write_bytes(pack.compress(plain.read_bytes()))
        plain.unlink()
        return file

    return write_packed


def laz(folder: Path) -> Path:
    return las(folder / "a.laz", POINTS + FAR_M, keys={3072: 26917})


def bag_folder(folder: Path) -> Path:
    """Write a bag of SQLite with its metadata."""
    from rosbags.rosbag2 import StoragePlugin, Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_JAZZY)
    types = store.types
    kind, none = "sensor_msgs/msg/JointState", np.zeros(0)
    path = folder / "bag"
    with Writer(path, version=9, storage_plugin=StoragePlugin.SQLITE3) as writer:
        line = writer.add_connection("/joint_states", kind, typestore=store)
        for k in range(20):
            stamp = types["builtin_interfaces/msg/Time"](7, 50_000_000 * k)
            head = types["std_msgs/msg/Header"](stamp, "")
            angles = 0.1 * np.sin(0.3 * k - np.arange(16.0))
            message = types[kind](head, list(ROBOT.joint_names), angles, none, none)
            writer.write(line, 50_000_000 * k, bytes(store.serialize_cdr(message, kind)))
    return path


def pictures() -> Iterator[np.ndarray]:
    for k in range(6):
        image = np.full((48, 64, 3), 230, np.uint8)
        cv2.circle(image, (20 + 3 * k, 24), 8, (40, 40, 40), -1)
        yield image


def film(name: str, code: str) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        file = folder / name
        out = cv2.VideoWriter(str(file), cv2.VideoWriter.fourcc(*code), 20.0, (64, 48))
        for image in pictures():
            out.write(image)
        out.release()
        return file

    return write


def images(ending: str) -> Callable[[Path], Path]:
    def write(folder: Path) -> Path:
        path = folder / "film"
        path.mkdir()
        for k, image in enumerate(pictures()):
            grey = cv2.cvtColor(image, cv2.COLOR_BGR2GRAY)
            cv2.imwrite(str(path / f"{k:03}.{ending}"), grey if ending == "pgm" else image)
        return path

    return write


def stack(folder: Path) -> Path:
    deep = [cv2.cvtColor(p, cv2.COLOR_BGR2GRAY).astype(np.uint16) * 100 for p in pictures()]
    cv2.imwritemulti(str(folder / "s.tif"), deep)
    return folder / "s.tif"


def npy(folder: Path) -> Path:
    np.save(folder / "a.npy", 0.1 * np.sin(np.arange(160.0)).reshape(10, 16))
    return folder / "a.npy"


def shipped(place: str) -> Callable[[Path], Path]:
    """Return what copies a file that the package ships."""

    def write(folder: Path) -> Path:
        return Path(shutil.copy(ROOT / place, folder))

    return write


def with_answers(folder: Path) -> Path:
    """Write a valid table whose stored answers are the damaged file."""
    path = folder / "set"
    path.mkdir()
    file = midlines(second=1e3)(path)
    file.with_name(f"{file.name}.reading.toml").write_text('time_unit = "ms"\n')
    return path


def read_with_answers(folder: Path, _: Options) -> None:
    load_file(folder / "bodies.csv", choice=Choice())


def others() -> Iterator[Target]:
    """Yield files that no case generates: packed ones, films, TOML, other containers."""
    for pack, ending in ((gzip, "gz"), (bz2, "bz2"), (lzma, "xz")):
        yield Target(f"joints, {ending}", packed(pack, ending, table()), read_joints)
        yield Target(f"midlines, {ending}", packed(pack, ending, midlines()), read_track)
    yield Target("joints, mcap", bags(start_s=0.0), read_joints)
    yield Target("joints, SQLite bag", bag_folder, read_joints)
    yield Target("npy", npy, read_track)
    yield Target("laz", laz, read_ground)
    yield Target("stl, binary", solid("a.stl"), read_ground, {"spacing_m": 2.0})
    names = {"avi": "MJPG", "mp4": "mp4v"}
    for ending, code in names.items():
        yield Target(f"film, {ending}", film(f"f.{ending}", code), read_film)
    for ending in ("png", "jpg", "tif", "bmp", "pgm", "webp"):
        yield Target(f"film, {ending}", images(ending), read_film)
    yield Target("film, stack", stack, read_film)
    yield Target("robot, toml", shipped("config/robots/yaw16.toml"), loads(load_robot))
    yield Target("world, toml", shipped("config/worlds/pegs.toml"), loads(load_world))
    yield Target("gait, toml", shipped("config/gaits/undulation-fast.toml"), loads(load_gait))
    yield Target("run, toml", shipped("config/runs/random-10.toml"), loads(load_run))
    yield Target("stored answers", with_answers, read_with_answers)
