"""What a user may get wrong: exit code 2, one line a fault with what would be right, no file.

One row a command line; a command that is new here brings its rows.
"""

from pathlib import Path

import numpy as np
import pytest
from mcap.writer import Writer

from snakewalk.controller.app.cli.main import main

_RUN = 'name = "mine"\nwaypoints_m = [[1.0, 0.0]]\n'
_NO_UTF8 = b"h\xe9.csv".decode(errors="surrogateescape")

ROWS = [
    ("report .", "a folder; a run's log is log.mcap"),
    ("report nosuch.mcap", "nosuch.mcap: No such file"),
    ("report empty", "is not an MCAP log"),
    ("replay .", "a folder; a run's log is log.mcap"),
    (f"capture {_NO_UTF8} -o t.npz", r"h\xe9.csv: this name is not UTF-8; rename the file"),
    (f"run --track {_NO_UTF8}", "this name is not UTF-8"),
    ("compare nosuch.mcap", "nosuch.mcap: one log is compared with nothing"),
    ("compare . .", "a folder; a run's log is log.mcap"),
    ("compare empty empty --picture a.txt", "a.txt: a picture ends in .png, .svg, .pdf"),
    ("compare empty empty --picture nosuch/a.png", "nosuch: no such folder"),
    ("plan nosuch", "nosuch: no such run; shipped are"),
    ("plan empty.toml", "empty.toml: name: is required"),
    ("plan pitch.toml", "robot pitch: has no yaw joint"),
    ("plan flat-square --robot one.toml", "has one yaw joint, which only bends to and fro"),
    ("run flat-square --robot one.toml", "has one yaw joint"),
    ("plan broken.toml", "broken.toml:3: not TOML: "),
    ("plan types.toml", "types.toml:3: seed: must be a whole number (got '3')"),
    ("plan types.toml", "types.toml:4: world: must be text (got 7)"),
    ("plan flat-square --world lava.toml", "lava.toml:2: ground: kind 'lava' is none of 'flat', "),
    ("plan ground.toml", "ground.toml:3: ground: unknown key; it is a key of a world's file"),
    ("bus serve --servos 1 --faults heat.toml", "heat.toml:5: fault.0.heat.for_s: unknown key ("),
    ("plan path.toml", "path.toml:1: name: holds '/'"),
    ("plan deep.toml", "deep.toml: not TOML: nested too deeply"),
    ("gait run deep.toml", "deep.toml: not TOML: nested too deeply"),
    ("plan dotted.toml", "dotted.toml: not TOML: a key of over 100 tables in line 1"),
    ("plan digits.toml", "digits.toml: not TOML: Exceeds the limit (4300 digits)"),
    ("plan points.toml", "points.toml:2: waypoints_m: must have at most 1000 values"),
    ("plan typo.toml", "typo.toml:3: cycle_herz: unknown key; did you mean cycle_hz?"),
    ("plan --seed 12345678901234567890123", "seed: "),
    ("plan jacksboro-traverse --with repertoire", "only on a flat one"),
    ("plan flat-slalom --with repertoire", "record --robot yaw16 --world flat -o"),
    ("plan bom.toml", "bom.toml:3: cycle_herz: unknown key"),
    ("init . --robot salamander", "has legs, which walk by gaits: snakewalk gait run trot"),
    ("init . --from nosuch", "nosuch: no such run; shipped are"),
    ("init . --robot typo.toml", "typo.toml:2: waypoints_m: unknown key"),
    ("init file.txt", "dir 'file.txt' is a file"),
    ("schema nosuch", "nosuch: no such file; there are run, robot, world"),
    ("schema run -o file.txt", "file.txt: exists; --force overwrites it"),
    ("run flat-square --out=", "nothing after --out: fill it"),
    ("run flat-square --out file.txt", "'--out' / '-o': dir 'file.txt' is a file"),
    ("gait run rolling --robot nosuch", "nosuch: no such robot"),
    ("track --picture nosuch/a.png", "nosuch: no such folder"),
    ("track --rate -5", "--rate -5: must be a positive number"),
    ("track --rate nan", "--rate nan: must be a positive number"),
    ("track --rate 30", "--rate 30: lamprey-like says its own rate"),
    ("analyse worm-like --rate 30", "--rate 30: worm-like says its own rate"),
    ("track one.csv", "one.csv: holds 1 frame"),
    ("track back.csv", "back.csv: t must increase from frame to frame"),
    ("track jump.csv", "it does not in 1 of 4 steps, first after frame 2"),
    ("track inf.csv", "11 of 55 rows lack one, or have one that is not finite"),
    ("track gaps.csv", "gaps: only 1 of 5 frames hold a midline"),
    ("track half.csv", "half.csv: 1 of 5 frame numbers are no whole numbers, such as 2.5"),
    ("track far.csv", "its frames span 9000001; a track has at most 500000"),
    ("run --track far.csv", "its frames span 9000001; a track has at most 500000"),
    ("track nan.wcon", "nan.wcon: 1 of 2 times t are no finite numbers"),
    ("track bomb.npz", "bomb.npz: its 0.0197 MB would expand to 20 MB; at most 100 times"),
    ("run --track bomb.npz", "bomb.npz: its 0.0197 MB would expand to 20 MB; at most 100 times"),
    ("report bomb.mcap", "bomb.mcap: its 0.00"),
    ("replay deep.mcap", "deep.mcap: breaks off before it says what ran"),
    ("tune rolling -o /proc/a.toml", "/proc: takes no file"),
    ("bus serve --servos 1 --record nosuch/a", "nosuch: no such folder"),
    ("bus serve --servos 1 --link nosuch/a", "nosuch: no such folder"),
    ("bus serve --servos 1 --link file.txt", "file.txt: "),
    ("bus serve --servos 1 --pace 0", "pace"),
    ("bus serve --servos 1 --latency -1", "must not be negative"),
    ("bus serve --servos 1 --latency nan", "--latency nan: must not be negative, nor without end"),
    ("bus serve --servos 1 --latency inf", "--latency inf: must not be negative"),
    ("bus serve --servos 1 --for nan", "--for nan: must be over 0 s"),
    ("bus serve --servos 1 --for -1", "--for -1: must be over 0 s"),
    ("bus serve --servos 1 --record x --link x", "--record and --link have the same name"),
    ("gait run rolling --gamepad file.txt", "file.txt: is a file; a gamepad is such as"),
    ("run flat-square --set run.waypoints_m=[[1e30,1]]", "waypoints_m.0.0: must be at most 1000"),
    ("ros --namespace ../x", "--namespace ../x: expected a name as snake"),
    ("terrain from high.csv -o w.toml --cell 0.1", "high.csv: holds heights of 3e+38 m"),
    ("bus sniff /dev/null", "/dev/null: is no serial device, which is such as /dev/ttyUSB0"),
    ("bus sniff empty", "empty: holds no exchange"),
    ("bus sniff noise.bin", "noise.bin: holds no packet in 400 bytes"),
    ("trials flat-slalom --robot nosuch --seeds 1", "nosuch: no such robot"),
    ("run flat-square --live", "--live: waypoints are set in the page: add --view"),
    ("run flat-square --set run.seed", "--set run.seed: expected KEY=VALUE"),
    ("run flat-square --set run.seed=-1", "run flat-square: seed: "),
    ("run flat-square --set run.seed=1e999", "run flat-square: seed: "),
    ("plan flat-square --set run.sed=3", "sed: unknown key; did you mean seed? (got 3)"),
    ("plan flat-square --set seed=3", "did you mean run.seed?"),
    ("plan flat-square --set run.behavior.sliding=0", "did you mean behaviour?"),
    ("plan flat-square --set run.name=../x", "name: holds '/'"),
    ("plan flat-square --set robot.joint_axes=yxy", "must have the letters y and p only"),
    ('plan flat-square --set run.name=""', "name: must not be empty"),
    ("plan flat-slalom --with repertoire --set run.seed=3", "takes no --motion"),
    ("play worm-like --set run.robot=yaw16", "run.robot: is given by --robot"),
    ("play worm-like --set world.friction.along=-1", "world flat: friction.along: "),
    ("gait run rolling --set run.gait.by=cpg", "run.gait.by: is given by --param"),
    ("gait run rolling --set robot.link_mas_kg=1", "did you mean link_mass_kg?"),
    ("trials flat-slalom --seeds 1 --over run=3", "run: a key begins with run., robot."),
    ("trials flat-slalom --seeds 1 --over run.seed=3 --over run.seed=4", "run.seed=V1,V2"),
    ("trials flat-slalom --seeds 1 --world flat --world nosuch", "nosuch: no such world"),
    ("run flat-square --world flat --world ramp-10", "for '--world': given 2 times, and takes one"),
    ("run flat-square --film --no-film", "for '--film': given 2 times"),
    ("run flat-square -o a --out b", "for '--out' / '-o': given 2 times"),
    ("run flat-square --seed 1 --seed 2 --seed 1", "for '--seed': given 3 times"),
    ("gait run rolling --robot yaw16 --robot yaw16", "for '--robot': given 2 times"),
    ("gait run rolling -p lift_rad=0.1 --param lift_rad=0.2", "lift_rad has a value already"),
    ("plan flat-square --set run.seed=1 --set run.seed=2", "run.seed has a value already"),
    ("bus set --id 1 --id 2 --baud 57600", "for '--id': given 2 times"),
    ("trials --track lamprey-like --track worm-like", "for '--track': given 2 times"),
    ("list --log-level info --log-level debug", "for '--log-level': given 2 times"),
    ("trials flat-slalom --seeds 1 --track nosuch.npz", "nosuch.npz: no such recording"),
    ("trials rolling --seeds 1 --track worm-like", "--track worm-like: is of walks"),
    ("trials flat-slalom --seeds 1 --seconds 9", "--seconds 9: is of gaits"),
    ("plan flat-square --set run.start_m=[1e9,0]", "start_m.0: must be at most 1000"),
    ("plan flat-square --beam 4", "--beam, --out, --run and --physics belong to --with"),
    ("run flat-square --view --view-at 192.0.2.1", "192.0.2.1 is no address of this machine"),
    ("run flat-square --view-at 127.0.0.1:99", "--view-at: is of the page: add --view"),
    ("run flat-square --no-film --look snake", "--look: is of the film, which --no-film leaves"),
    ("report empty --no-film --fine", "--fine: is of the film"),
    ("list --quiet --verbose", "--verbose, --quiet and --log-level say the same thing"),
    ("replay empty --out file.txt", "file.txt: exists; --force overwrites it"),
    ("replay empty --out ./empty --force", "empty: is the log itself; give another name"),
    ("replay empty --out nosuch/x.mcap", "nosuch: no such folder"),
    ("synthesise flat-square -o x --frames 100000000000", "'--frames': Input should be less"),
    ("synthesise flat-square -o x --set run.time_limit_s=1e12", "are over 300000 frames"),
    ("repertoire run list.json", "list.json: not a plan (no JSON object)"),
    ("repertoire run object.json", "object.json: not a plan ('format' is missing)"),
    ("terrain from cells.csv -o w.toml --cell 1e-300", "--cell 1e-300: must be from 1e-06 to"),
    ("terrain from heights.csv -o w.toml --cell 1e6", "a map of 1e+06 m at a scale of 1; the most"),
    ("robot import loop.urdf -o r.toml", "on which all hang: each hangs on another"),
    ("policy run wave-cma --seconds 1e12", "'--seconds': Input should be less"),
    ("policy learn -o p.toml --steps 1000000000000", "'--steps': Input should be less"),
    ("fish synthesise empty --seconds 1e12", "'--seconds': Input should be less"),
    ("camera check flat-square --device 99", "camera 99: OpenCV cannot open it"),
    # commands that came later
    ("policy run nosuch", "nosuch: no such policy; shipped are wave-cma, wave-ppo"),
    ("policy run typo.toml", "typo.toml: robot: is required"),
    ("policy run wave-ppo --robot alternating16", "its network observes the joints of yaw16"),
    ("policy run wave-cma --set run.time_limit_s=9", "run.time_limit_s: is given by --seconds"),
    ("policy learn -o file.txt", "file.txt: a policy's file ends in .toml"),
    ("policy learn -o /nosuch/a.toml", "/nosuch: no such folder"),
    ("policy trials nosuch --seeds 1", "nosuch: no such policy"),
    ("view .", "a folder; a run's log is log.mcap"),
    ("view empty", "is not an MCAP log"),
    ("view empty --view-at 127.0.0.1:99999", "expected HOST or HOST:PORT, e.g. 127.0.0.1:8080"),
    ("stop nosuch", "nosuch: no such run is under way"),
    ("run flat-slalom --set run.physics_step_s=1e-9", "physics_step_s: must be at least 2e-05"),
    ("run flat-slalom --set run.deviation.mass=0", "deviation.mass: must be over 0 (got 0)"),
    (
        "trials flat-slalom --first-seed 99999999999999999999999",
        "'--first-seed': Input should be less",
    ),
    ("stop nosuch --port /dev/nosuch", "stop takes a run or --port, not both"),
    ("stop --port /dev/nosuch", "/dev/nosuch: no such port"),
    ("stop --port file.txt", "file.txt: is no serial device, which is such as /dev/ttyUSB0"),
    ("stop --port /dev/nosuch --baud 123", "--baud 123: servos have 9600, 57600"),
    ("scan --port /dev/null", "/dev/null: is no serial device"),
    ("doctor --port file.txt", "file.txt: is no serial device"),
    ("export nosuch.mcap", "say what to write: --csv FOLDER, --parquet FOLDER"),
    ("export empty --csv t", "is not an MCAP log"),
    ("export empty --csv file.txt", "'--csv': dir 'file.txt' is a file"),
    ("export empty --foxglove a.txt", "a.txt: is an MCAP file; name it a.mcap"),
    ("export empty --ros2 a.mcap --foxglove a.mcap", "--ros2 and --foxglove have the same name"),
    ("export noise.bin --ros2 a.mcap", "noise.bin: is not an MCAP log"),
    ("identify noise.bin", "noise.bin: is not JSON"),
    ("identify list.json", "list.json: expected a JSON object"),
    ("identify list.json --no-fit", "--no-fit judges constants: give them with --start FILE"),
    ("identify list.json -o file.txt", "file.txt: exists; --force overwrites it"),
    ("identify list.json -o nosuch/a.json", "nosuch: no such folder"),
    ("identify nosuch.mcap", "nosuch.mcap: No such file"),
    ("identify nosuch.mcap list.json", "give one kind at a time"),
    ("identify nosuch.mcap -o found.json", "found.json: friction is written as a world's file"),
    ("identify list.json --world flat", "--world is the ground of a run's log"),
    ("terrain from nosuch.tif -o w.toml", "nosuch.tif: No such file"),
    ("terrain from noise.bin -o w.toml", "noise.bin: ends in none of .tif .tiff .asc"),
    ("terrain from text.png -o w.toml", "text.png: is no PNG"),
    ("terrain from cells.csv -o w.toml --cell 1", "1 of its cells are no numbers, such as 'x'"),
    ("terrain from cells.csv -o w.toml --cell nan", "--cell nan: must be above 0"),
    ("terrain from cells.csv -o w.toml --scale -2", "--scale -2: must be above 0"),
    ("terrain from cells.csv -o w.toml --crop 1,2", "--crop 1,2: expected X0,Y0,X1,Y1"),
    ("terrain from cells.csv -o w.toml --crop 1,1,0,0", "X1 must be over X0, and Y1 over Y0"),
    ("terrain from cells.csv -o w.toml --unit parsec", "is none of m, cm, mm, km, ft, deg"),
    ("terrain from cells.csv -o w.toml --point mode", "is none of lowest, median, highest"),
    ("terrain from cells.csv -o w.txt", "w.txt: a world's file ends in .toml"),
    ("terrain from cells.csv -o one.toml", "one.toml: exists; --force overwrites it"),
    ("terrain from flat.npz -o w.toml", "holds no array named 'elevation', but z"),
    ("run --map lidar", "--map lidar: the walk knows its ground from: world, stereo"),
    ("run --map stereo", "robot alternating16 has no stereo head"),
    ("terrain from-stereo a.png b.png --calibration no.yml -o w.toml", "no.yml: No such file"),
    ("terrain from-stereo a.png b.png --calibration empty -o w.toml --unit inch", "--unit inch"),
    (
        "terrain from-stereo a.png b.png --calibration empty -o w.toml --height -1",
        "must be above 0",
    ),
    ("calibrate -o file.txt --port /dev/nosuch", "file.txt: a robot's file ends in .toml"),
    ("calibrate -o r.toml --port /dev/nosuch --current -1", "over 0 and at most 2 A"),
    ("calibrate -o r.toml --port /dev/nosuch --homing-offset", "nobody is there: say --yes"),
    ("calibrate -o r.toml --port /dev/nosuch --yes", "--yes: goes with --homing-offset"),
    ("bus backup -o file.txt --port /dev/nosuch", "file.txt: exists; --force overwrites it"),
    ("bus backup -o a.json --port /dev/nosuch", "/dev/nosuch: no such port"),
    ("bus restore list.json --port /dev/nosuch", "list.json: no backup of servos"),
    ("bus restore noise.bin --port /dev/nosuch", "noise.bin: not JSON"),
    ("bus restore deep.json --port /dev/nosuch", "deep.json: not JSON: nested too deeply"),
    ("bus restore /dev/zero --port /dev/nosuch", "/dev/zero: is larger than the 64 MB"),
    ("bus serve --play deep.json", "deep.json: line 1: no packet as bus serve --record writes it"),
    ("bus serve --play noise.bin", "noise.bin: is no exchange of bus serve --record"),
    ("bus sniff deep.json", "deep.json: line 1: neither hex bytes nor a recorded packet"),
    ("identify deep.json", "deep.json: is not JSON"),
    ("repertoire run deep.json", "deep.json: not a plan (nested too deeply)"),
    ("robot import noise.bin -o r.toml", "noise.bin: 'utf-8' codec can't decode byte"),
    ("robot import /dev/zero -o r.toml", "/dev/zero: is larger than the 20 MB that are read"),
    ("terrain from-stereo a.png b.png --calibration deep.yml -o w.toml", "nested 99999 deep"),
    ("repertoire play noise.bin", "noise.bin: not a repertoire"),
    ("repertoire play --seconds -1", "--seconds -1: must be over 0"),
    ("run salamander-square --robot yaw16", "gait trot needs two pairs of legs"),
    ("run salamander-square --motion walk", "a robot with legs runs gaits"),
    ("run salamander-square --track worm-like", "moves by a gait: leave --track out"),
    ("run salamander-square --set run.gait.name=rolling", "not steered along waypoints"),
    ("plan salamander-square --world ramp-10", "run it by: snakewalk run salamander-square"),
    ("gait run trot --robot yaw16", "gait trot needs two pairs of legs"),
    ("gait run trot --param turn=99", "turn: must be at most 1.6 (got 99)"),
    ("robot export yaw16", "say what to write: --urdf FILE, --mjcf FILE, or both"),
    ("init file.txt/x", "file.txt/x: cannot be made: Not a directory"),
    ("schema", "Missing argument 'kind'"),
    ("synthesise flat-square -o x --motion nosuch", "motion: must be 'walk'"),
    ("synthesise flat-square -o x --animal nosuch", "--animal nosuch: no such animal; shipped are"),
    ("synthesise flat-square -o x --animal goat --motion kp", "--motion: is for snakes; --animal"),
    ("synthesise flat-square -o x --animal nosuch.toml", "nosuch.toml: no such file"),
    ("synthesise flat-square -o x --look nosuch", "--look nosuch: is for --film and --glb"),
    ("nosuch", "No such command 'nosuch'"),
]


@pytest.mark.parametrize(("words", "said"), ROWS, ids=[words for words, _ in ROWS])
def test_bad_input_is_told_and_nothing_is_written(
    words: str,
    said: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    for name, text in {
        "empty": "",
        "empty.toml": "",
        "file.txt": "mine",
        "path.toml": _RUN.replace("mine", "../../mine"),
        "typo.toml": f"{_RUN}cycle_herz = 50\n",
        "bom.toml": f"\ufeff{_RUN}cycle_herz = 50\n",
        "one.toml": 'name = "one"\njoint_axes = "y"\n',
        "broken.toml": f"{_RUN}seed = 3 4\n",
        "types.toml": f'{_RUN}seed = "3"\nworld = 7\n',
        "lava.toml": 'name = "w"\nground = { kind = "lava" }\n',
        "ground.toml": f"{_RUN}[ground]\n",
        "list.json": "[]",
        "object.json": "{}",
        "heights.csv": "0,1\n1,0\n",
        "loop.urdf": '<robot name="x"><link name="a"/><link name="b"/>'
        '<joint name="j" type="revolute"><parent link="a"/><child link="b"/></joint>'
        '<joint name="k" type="revolute"><parent link="b"/><child link="a"/></joint></robot>',
        "deep.json": 99_999 * "[",
        "deep.yml": "%YAML:1.0\n---\na: " + 99_999 * "[",
        "deep.toml": "name = " + 9_999 * "[",
        "dotted.toml": 999 * "a." + "b = 1",
        "digits.toml": f"{_RUN}seed = " + 4_999 * "9",
        "points.toml": 'name = "mine"\nwaypoints_m = [' + 1_001 * "[1.0, 0.0], " + "]\n",
        "text.png": "no picture",
        "cells.csv": "0,1\nx,2\n",
        "high.csv": "0,1,0,1\n0,3e38,1,0\n",
        "heat.toml": '[[fault]]\nkind = "heat"\nids = [1]\ncelsius = 75\nfor_s = 2.0\n',
        "pitch.toml": f'{_RUN}robot = "body.toml"\n',
        "body.toml": 'name = "pitch"\njoint_axes = "pppppppp"\n',
    }.items():
        Path(name).write_text(text)
    np.savez("flat.npz", z=np.zeros((4, 4)))
    Path("noise.bin").write_bytes(np.random.default_rng(0).bytes(400))
    x = np.linspace(0.0, 10.0, 11)
    for name, frames in (("one.csv", [0]), ("back.csv", [0, 1])):
        rows = [f"{-frame},{frame},{i},{x[i]},{frame}" for frame in frames for i in range(len(x))]
        Path(name).write_text("\n".join(["t,frame,point,x_m,y_m", *rows]) + "\n")
    for name, times, numbers in (
        ("jump.csv", [0, 1, 2, 1.5, 4], range(5)),
        ("inf.csv", [0, 1, np.inf, 3, 4], range(5)),
        ("gaps.csv", range(5), range(5)),
        ("half.csv", range(5), [0, 1, 2, 2.5, 4]),
        ("far.csv", range(5), [0, 1, 2, 3, 9_000_000]),
    ):
        shown = x + (np.inf if name == "gaps.csv" else 0.0)
        rows = [
            f"{at},{frame},{i},{(shown if k else x)[i]},{k}"
            for k, (at, frame) in enumerate(zip(times, numbers, strict=True))
            for i in range(len(x))
        ]
        Path(name).write_text("\n".join(["t,frame,point,x_m,y_m", *rows]) + "\n")
    Path("nan.wcon").write_text(
        '{"units": {"t": "s", "x": "m", "y": "m"}, "data": {"id": "a", "t": [0, NaN], '
        '"x": [[0, 1, 2, 3], [0, 1, 2, 3]], "y": [[0, 0, 0, 0], [0, 0, 0, 0]]}}'
    )
    if "bomb.npz" in words:
        np.savez_compressed("bomb.npz", points=np.zeros(20_000_000, bool))
    for name, row in (("bomb.mcap", b" " * 20_000_000), ("deep.mcap", b"[" * 100_000)):
        if name not in words:
            continue
        with Path(name).open("wb") as file:
            writer = Writer(file)
            writer.start()
            writer.add_message(writer.register_channel("/config", "json", 0), 0, row, 0)
            writer.finish()
    before = sorted(tmp_path.rglob("*"))
    monkeypatch.setattr("sys.argv", ["snakewalk", *words.split()])
    with pytest.raises(SystemExit) as end:
        main()
    told = [line for line in capsys.readouterr().err.splitlines() if "snakewalk:" in line]
    assert end.value.code == 2
    assert told
    assert any(said in line for line in told), told
    assert sorted(tmp_path.rglob("*")) == before
    assert Path("file.txt").read_text() == "mine"
