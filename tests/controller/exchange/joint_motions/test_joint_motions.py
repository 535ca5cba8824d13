"""Joint angles of CSV tables, ROS 2 bags and LeRobot datasets play on a robot's joints."""

import json
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.config.loader import load_robot
from snakewalk.config.reading import Fact
from snakewalk.controller.console.plugins import names
from snakewalk.controller.exchange.joint_motions.ros_joints import motion_of_rows
from snakewalk.controller.motion.joint_motion import joint_motion, onto_robot
from snakewalk.controller.run.factory import prepare_playback
from snakewalk.controller.run.request import RunRequest
from snakewalk.controller.run.run_robot import check
from tests.helpers.command import snakewalk

ROBOT = load_robot("yaw16")
NAMES = ROBOT.joint_names
RATE_HZ, ROWS = 20.0, 60
TIME_S = np.arange(ROWS) / RATE_HZ
ANGLES = 0.3 * np.sin(2.0 * np.pi * (0.5 * TIME_S[:, None] - np.arange(len(NAMES)) / 10.0))
STATED = {"unit": Fact("rad", "file", "a"), "time": Fact("s", "file", "a")}


def table(path: Path, header: list[str], values: np.ndarray = ANGLES, separator: str = ",") -> None:
    rows = [separator.join(header)]
    rows += [separator.join([f"{at:.4f}", *(f"{v:.6f}" for v in row)])
             for at, row in zip(TIME_S, values, strict=True)]  # fmt: skip
    path.write_text("\n".join(rows) + "\n")


def bag(
    path: Path,
    joints: tuple[str, ...] = NAMES,
    *,
    trajectory: bool = False,
    start_s: float = 7.0,
    publishers: tuple[slice, ...] = (slice(None),),
    fingers: tuple[float, ...] = (),
) -> None:
    """Write a bag; ``fingers`` are times of messages of a gripper, ahead of all others."""
    from mcap.writer import Writer
    from rosbags.typesys import Stores, get_typestore

    store = get_typestore(Stores.ROS2_JAZZY)
    types = store.types
    time, duration = types["builtin_interfaces/msg/Time"], types["builtin_interfaces/msg/Duration"]
    header = types["std_msgs/msg/Header"]
    none = np.zeros(0)

    def parts(at: float) -> tuple[int, int]:
        return int(at), round(1e9 * (at - int(at)))

    writer = Writer(str(path))
    writer.start(profile="ros2")

    def send(topic: str, kind: str, at: float, message: object) -> None:
        text = store.generate_msgdef(kind, ros_version=2)[0]
        schema = writer.register_schema(kind, "ros2msg", text.encode())
        channel = writer.register_channel(topic, "cdr", schema)
        writer.add_message(channel, round(at * 1e9), bytes(store.serialize_cdr(message, kind)), 0)

    if trajectory:
        kind = "trajectory_msgs/msg/JointTrajectory"
        point = types["trajectory_msgs/msg/JointTrajectoryPoint"]
        points = [point(row, none, none, none, duration(*parts(at)))
                  for at, row in zip(TIME_S, ANGLES, strict=True)]  # fmt: skip
        send("/goal", kind, 1.0, types[kind](header(time(1, 0), ""), list(joints), points))
    else:
        kind = "sensor_msgs/msg/JointState"
        for at in fingers:
            stamp = header(time(*parts(start_s + at)), "")
            message = types[kind](stamp, ["finger"], np.full(1, at), none, none)
            send("/joint_states", kind, 7.0 + at, message)
        for k, (at, row) in enumerate(zip(TIME_S, ANGLES, strict=True)):
            for late, part in enumerate(publishers):
                order = np.arange(len(joints))[part]
                order = np.roll(order, k % 2)  # publishers may change the order
                named = [joints[n] for n in order]
                sent_s = at + 0.002 * late
                stamp = header(time(*parts(start_s + sent_s)), "")
                message = types[kind](stamp, named, row[order], none, none)
                send("/joint_states", kind, 7.0 + sent_s, message)
    writer.finish()


def dataset(path: Path, version: str = "v2.1", unit: float = 1.0) -> None:
    import pyarrow
    import pyarrow.parquet

    feature = {"dtype": "float32", "names": {"motors": [f"{name}.pos" for name in NAMES]}}
    about = {"codebase_version": version, "fps": RATE_HZ, "total_episodes": 2}
    (path / "meta").mkdir(parents=True)
    (path / "meta" / "info.json").write_text(
        json.dumps(about | {"features": {"observation.state": feature}})
    )
    folder = path / "data" / "chunk-000"
    folder.mkdir(parents=True)
    tables = [
        pyarrow.table({
            "timestamp": TIME_S,
            "episode_index": np.full(ROWS, episode),
            "observation.state": list(unit * ANGLES * (1.0 - 0.5 * episode)),
        })
        for episode in (0, 1)
    ]  # fmt: skip
    if version == "v3.0":
        pyarrow.parquet.write_table(pyarrow.concat_tables(tables), folder / "file-000.parquet")
        return
    for episode, held in enumerate(tables):
        pyarrow.parquet.write_table(held, folder / f"episode_{episode:06d}.parquet")


def plays(path: Path, expected: np.ndarray = ANGLES, **options: object) -> tuple[str, ...]:
    """Prepare the file, compare the joints, and return the notes."""
    prepared = prepare_playback(str(path), **options)
    time_s, joints = prepared.joint_track
    np.testing.assert_allclose(time_s, TIME_S, atol=1e-6)
    np.testing.assert_allclose(joints, expected, atol=1e-5)
    return prepared.notes


def test_readers_are_plug_ins() -> None:
    assert {"csv", "lerobot", "ros2"} <= set(names("joints"))


@pytest.mark.fast_cases(6)
@pytest.mark.parametrize(
    ("header", "factor", "unit"),
    [
        (["time", *NAMES], 1.0, "rad"),
        (["time [s]", *(f"{name}_deg" for name in NAMES)], 180.0 / np.pi, None),
        (["t", *(f"{name} [rad]" for name in NAMES)], 1.0, None),
        (["time_s", *NAMES], 180.0 / np.pi, "deg"),
    ],
)
@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_a_table_of_joint_angles(
    header: list[str], factor: float, unit: str | None, separator: str, tmp_path: Path
) -> None:
    table(tmp_path / "a.csv", header, factor * ANGLES, separator)
    (mapping,) = plays(tmp_path / "a.csv", unit=unit)
    assert mapping.startswith(f"joints by name: {NAMES[0]} = {NAMES[0]}")


def test_a_table_that_states_no_unit_is_asked_about_with_the_likely_one(tmp_path: Path) -> None:
    table(tmp_path / "a.csv", ["time", *NAMES])
    with pytest.raises(InputError, match=r"states no unit of angles.*--unit rad"):
        plays(tmp_path / "a.csv")
    table(tmp_path / "a.csv", ["time", *NAMES], 180.0 / np.pi * ANGLES)
    with pytest.raises(InputError, match=r"go to 17\.2; .*: up to 17\.2° \(--unit deg\)$"):
        plays(tmp_path / "a.csv")


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("trajectory", [False, True])
def test_a_bag_of_joint_states_or_of_a_trajectory(trajectory: bool, tmp_path: Path) -> None:
    bag(tmp_path / "b.mcap", trajectory=trajectory)
    notes = plays(tmp_path / "b.mcap")
    assert notes[0].startswith("joints by name")
    assert notes[1] == f"topic {'/goal' if trajectory else '/joint_states'}"


def test_a_bag_without_joints_or_that_is_cut_is_one_line(tmp_path: Path) -> None:
    bag(tmp_path / "b.mcap")
    data = (tmp_path / "b.mcap").read_bytes()
    with pytest.raises(InputError, match=r"--topic /tf: no joint messages there.*/joint_states"):
        plays(tmp_path / "b.mcap", topic="/tf")
    (tmp_path / "b.mcap").write_bytes(data[: len(data) // 2])
    with pytest.raises(InputError, match="cannot be read as a ROS 2 bag"):
        plays(tmp_path / "b.mcap")


@pytest.mark.fast_cases(1)
@pytest.mark.parametrize("version", ["v2.1", "v3.0"])
def test_an_episode_of_a_lerobot_dataset(version: str, tmp_path: Path) -> None:
    dataset(tmp_path / "set", version, 180.0 / np.pi)
    with pytest.raises(InputError, match="has 2 episodes; give --episode 0 to 1"):
        plays(tmp_path / "set")
    with pytest.raises(InputError, match=r"states no unit of angles.*--unit deg"):
        plays(tmp_path / "set", episode=1)
    joints = {name: f"{name}.pos" for name in NAMES}
    notes = plays(tmp_path / "set", 0.5 * ANGLES, episode=1, unit="deg", joints=joints)
    assert f"{NAMES[0]} = {NAMES[0]}.pos" in notes[0]
    assert notes[1] == f"episode 1 of 2, observation.state, LeRobot {version}"
    assert plays(tmp_path / "set", episode=0, unit="deg")[0].startswith("joints by number")


def test_joints_are_mapped_by_request_and_the_rest_is_reported() -> None:
    motion = joint_motion(Path("a"), TIME_S, [f"m{k}" for k in range(17)],
                          np.column_stack([ANGLES, TIME_S]), **STATED)  # fmt: skip
    with pytest.raises(
        InputError, match=f"a: the file has no joint for {NAMES[0]},.*but .*--joint {NAMES[0]}=NAME"
    ):
        onto_robot(motion, ROBOT, {}, "a")
    asked = {name: f"m{k}" for k, name in enumerate(NAMES)} | {NAMES[3]: "rest"}
    mapped = onto_robot(motion, ROBOT, asked, "a")
    joints, lines = mapped.joint_rad, mapped.notes
    assert mapped.names == tuple(asked.values())
    assert not joints[:, 3].any()
    np.testing.assert_array_equal(joints[:, 4], ANGLES[:, 4])
    assert lines[1] == "2 joints of the file are not used, 2 of them move: m3, m16"
    with pytest.raises(InputError, match="--joint tail=m1: yaw16 has"):
        onto_robot(motion, ROBOT, {"tail": "m1"}, "a")
    with pytest.raises(InputError, match=f"--joint {NAMES[0]}=x: a has m0"):
        onto_robot(motion, ROBOT, {NAMES[0]: "x"}, "a")


def test_gaps_and_rows_without_a_value_are_counted() -> None:
    kept = np.setdiff1d(np.arange(ROWS), np.arange(20, 29))
    angles = ANGLES[kept].copy()
    angles[5, 2] = np.nan
    motion = joint_motion(Path("a"), TIME_S[kept], NAMES, angles, **STATED)
    mapped = onto_robot(motion, ROBOT, {}, "a")
    assert len(mapped.time_s) == len(mapped.joint_rad) == 50
    assert list(mapped.notes[1:]) == [
        "1 of 51 rows lack a value and are left out",
        "10 rows are missing in 2 gaps of up to 0.5 s",
    ]


def broken(change: Callable[[str], str]) -> Callable[[Path], None]:
    def make(path: Path) -> None:
        table(path, ["time", *NAMES])
        path.write_text(change(path.read_text()))

    return make


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (broken(lambda text: text.replace("0.0500,", "0.0000,", 1)), "time must increase"),
        (broken(lambda text: text.replace("0.1000,", "0.1000,left,", 1)), "line 4: 17 cells|18"),
        (broken(lambda text: text.replace(f",{NAMES[1]},", f",{NAMES[0]},", 1)), "is there twice"),
        (broken(lambda text: "\n".join(text.splitlines()[:2])), "1 complete rows"),
        (lambda path: path.write_text(",".join(["time_ms", *NAMES])), "0 complete rows"),
    ],
)
def test_faults_of_a_table(make: Callable[[Path], None], said: str, tmp_path: Path) -> None:
    make(tmp_path / "a.csv")
    with pytest.raises(InputError, match=said):
        plays(tmp_path / "a.csv", unit="rad")


def test_options_of_joint_files_are_rejected_for_midlines() -> None:
    with pytest.raises(InputError, match="--unit: worm-like has no joint angles with names"):
        prepare_playback("worm-like", unit="rad")
    with pytest.raises(InputError, match="--time-unit: a shipped recording needs no unit of time"):
        _ = prepare_playback("worm-like", time_unit="ms").joint_track
    assert (
        snakewalk("play", "worm-like", "--unit", "grad").stderr.count("is not one of 'rad', 'deg'")
        == 1
    )


def in_order(path: Path, joints: list[str]) -> str:
    """Return how the joints of a table are mapped onto yaw16."""
    table(path, ["time_s", *(f"{name}_rad" for name in joints)])
    (line, *_) = prepare_playback(str(path)).notes
    return line


def test_names_of_one_stem_are_mapped_by_their_numbers(tmp_path: Path) -> None:
    alphabet = sorted(f"joint_{k}" for k in range(1, 17))
    assert alphabet[1] == "joint_10"
    line = in_order(tmp_path / "a.csv", alphabet)
    assert line.startswith("joints by number: yaw_01 = joint_1, yaw_02 = joint_2, yaw_03 = joint_3")
    prepared = prepare_playback(str(tmp_path / "a.csv"))
    np.testing.assert_allclose(
        prepared.joint_track[1][:, 1], ANGLES[:, alphabet.index("joint_2")], atol=1e-5
    )


def mapping(names: list[str], robot: str) -> str:
    """Return how joints of a file, one of which moves, are mapped onto a robot."""
    motion = joint_motion(Path("a.csv"), TIME_S, names, ANGLES, **STATED)
    return onto_robot(motion, load_robot(robot), {}, "a.csv").notes[0]


def test_names_of_several_stems_are_mapped_by_their_numbers_within_the_robots_stems() -> None:
    kinds = [f"{kind}_joint_{k}" for kind in ("Pitch", "Yaw") for k in range(1, 9)]
    line = mapping(sorted(kinds), "alternating16")
    assert line.startswith("joints by number: ")
    pairs = dict(pair.split(" = ") for pair in line.removeprefix("joints by number: ").split(", "))
    assert {ours[:3].title() for ours, theirs in pairs.items() if theirs.startswith("Yaw")} == {
        "Yaw"
    }
    yaws = [pairs[name] for name in sorted(pairs) if name.startswith("yaw")]
    assert yaws == [f"Yaw_joint_{k}" for k in range(1, 9)]


@pytest.mark.parametrize(
    "names",
    [
        [f"{'ab'[k % 2]}{k}" for k in range(16)],
        [f"{'ab'[k // 8]}{k % 8}" for k in range(16)],
        ["neck", *(f"joint_{k}" for k in range(15))],
    ],
)
def test_names_without_an_order_on_the_body_are_asked_about(names: list[str]) -> None:
    with pytest.raises(InputError, match=f"--joint yaw_01={names[0]} --joint yaw_02={names[1]} "):
        mapping(names, "yaw16")


@pytest.mark.parametrize(
    ("column", "size", "said"),
    [
        ("timestamp", 1e3, r"5\.98 s at 50 Hz|\(--time-unit ms\)"),
        ("time", 1e9, r"\(--time-unit ns\)"),
        ("t", 1e6, r"\(--time-unit us\)"),
    ],
)
def test_a_unit_of_time_that_no_column_states_is_asked_for(
    column: str, size: float, said: str, tmp_path: Path
) -> None:
    path = tmp_path / "a.csv"
    table(path, [column, *(f"{name}_rad" for name in NAMES)])
    lines = path.read_text().splitlines()
    rows = [line.split(",") for line in lines[1:]]
    path.write_text(
        "\n".join(
            [lines[0], *(",".join([f"{size * float(row[0]):.0f}", *row[1:]]) for row in rows)]
        )
    )
    with pytest.raises(InputError, match=said):
        prepare_playback(str(path))
    unit = {1e3: "ms", 1e6: "us", 1e9: "ns"}[size]
    time_s, _ = prepare_playback(str(path), time_unit=unit).joint_track
    np.testing.assert_allclose(time_s, TIME_S, atol=1e-3)


def test_a_stated_unit_of_time_is_not_asked_for(tmp_path: Path) -> None:
    table(tmp_path / "a.csv", ["time_s", *(f"{name}_rad" for name in NAMES)])
    with pytest.raises(InputError, match="states s; leave the option out"):
        prepare_playback(str(tmp_path / "a.csv"), time_unit="ms")


def test_a_bag_whose_first_stamp_is_zero_has_one_clock(tmp_path: Path) -> None:
    bag(tmp_path / "b.mcap", start_s=0.0)
    prepared = prepare_playback(str(tmp_path / "b.mcap"))
    np.testing.assert_allclose(prepared.joint_track[0], TIME_S, atol=1e-6)
    assert not [line for line in prepared.notes if "missing" in line]


def test_a_bag_of_two_publishers_and_a_gripper_is_complete(tmp_path: Path) -> None:
    bag(
        tmp_path / "b.mcap",
        start_s=0.0,
        publishers=(slice(0, 8), slice(8, 16)),
        fingers=(0.0, 0.05),
    )
    prepared = prepare_playback(str(tmp_path / "b.mcap"))
    time_s, joints = prepared.joint_track
    first = TIME_S[1:-1] if len(time_s) == ROWS - 2 else TIME_S[1:]
    assert len(time_s) >= ROWS - 2
    np.testing.assert_allclose(np.diff(time_s), 1.0 / RATE_HZ, atol=1e-6)
    wanted = 0.3 * np.sin(2.0 * np.pi * (0.5 * first[:, None] - np.arange(len(NAMES)) / 10.0))
    np.testing.assert_allclose(joints, wanted, atol=4e-3)  # 2 ms between the publishers
    assert any("1 joints of the file are not used" in line for line in prepared.notes)
    assert any(line.startswith("other messages have finger, yaw_09") for line in prepared.notes)


def test_angles_are_not_interpolated_over_a_gap_of_their_publisher(tmp_path: Path) -> None:
    names = NAMES[:2]
    rows = [(at, (names[0],), (at,)) for at in TIME_S.tolist()]
    rows += [(at, (names[1],), (-at,)) for at in TIME_S.tolist() if not 0.5 < at < 1.5]
    motion = motion_of_rows(Path("b"), "/j", iter(rows))
    assert motion.names == names
    between = (motion.time_s > 0.5) & (motion.time_s < 1.5)
    np.testing.assert_array_equal(np.isnan(motion.joint_rad[:, 1]), between)


def test_decimal_commas_are_read(tmp_path: Path) -> None:
    table(tmp_path / "a.csv", ["time", *(f"{name}_rad" for name in NAMES)], separator=";")
    path = tmp_path / "a.csv"
    path.write_text(path.read_text().replace(".", ","))
    plays(path)
    path.write_text('time,a_rad\n"1,000","1,200"\n"2,000","1,300"\n')
    with pytest.raises(InputError, match="'1,000' has a comma for decimals or for thousands"):
        plays(path)


def test_a_run_logs_the_mapping(tmp_path: Path) -> None:
    table(tmp_path / "a.csv", ["time", *(f"{name}_rad" for name in NAMES)])
    events: list[tuple[str, str]] = []
    prepared = prepare_playback(str(tmp_path / "a.csv"))
    prepared.make_source(lambda kind, text, *_: events.append((kind, text)))
    assert ("recording", prepared.notes[0]) in events


@pytest.mark.slow
@pytest.mark.slow_cases(1, "32 damaged files each: 4 s of CPU")
@pytest.mark.parametrize("seed", range(3))
def test_damaged_files_of_each_reader_end_in_one_line(tmp_path: Path, seed: int) -> None:
    table(tmp_path / "a.csv", ["time", *(f"{name}_rad" for name in NAMES)])
    bag(tmp_path / "b.mcap")
    dataset(tmp_path / "set", "v3.0")
    parquet = tmp_path / "set" / "data" / "chunk-000" / "file-000.parquet"
    info = tmp_path / "set" / "meta" / "info.json"
    rng = np.random.default_rng(seed)
    answers = {"episode": 0, "unit": "rad"}
    for file, given in (
        (tmp_path / "a.csv", {}),
        (tmp_path / "b.mcap", {}),
        (parquet, answers),
        (info, answers),
    ):
        whole = file.read_bytes()
        played = str(tmp_path / "set") if given else str(file)
        for _ in range(8):
            data = bytearray(whole)
            for at in rng.integers(0, len(data), 3):
                data[at] = rng.integers(0, 256)
            file.write_bytes(data[: rng.integers(1, len(data))] if rng.random() < 0.3 else data)
            faults: tuple[str, ...] = ("",)
            try:
                prepare_playback(played, **given)
            except InputError as error:
                faults = error.faults
            assert len(faults) == 1
        file.write_bytes(whole)


def test_a_new_mapping_is_asked_about_once_before_it_moves_servos(tmp_path: Path) -> None:
    file = tmp_path / "a.csv"
    table(file, ["time_s", *(f"m{k}_rad" for k in range(16))])
    prepared = prepare_playback(str(file), robot="yaw16")
    request = RunRequest(prepared, None, "./tty")
    with pytest.raises(InputError) as asked:
        check(request)
    lines = asked.value.faults
    assert re.fullmatch("head <=1==2=.*=16=> tail", lines[1])
    assert lines[2] == "1: joint yaw_01 (ID 1): m0, -17° to 17°"
    code = re.search("--mapping ([0-9a-f]{8}) --remember", lines[-1])
    assert code is not None
    file.with_name("a.csv.reading.toml").write_text(f'mapping = "{code[1]}"')
    check(request)
    check(RunRequest(prepare_playback(str(file), mapping=code[1], robot="yaw16"), None, "./tty"))
    turned = {name: f"m{15 - k}" for k, name in enumerate(NAMES)}
    another = prepare_playback(str(file), joints=turned, robot="yaw16")
    with pytest.raises(InputError, match=r"a\.csv: check which joint"):
        check(RunRequest(another, None, "./tty"))
    check(RunRequest(another, None, None))
