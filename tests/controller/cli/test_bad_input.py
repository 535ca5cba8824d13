"""What a user may get wrong: exit code 2, one line a fault with what would be right, no file.

One row a command line; a command that is new here brings its rows.
"""

from pathlib import Path

import numpy as np
import pytest
from mcap.writer import Writer

from snakewalk.controller.cli.main import main

_RUN = 'name = "mine"\nwaypoints_m = [[1.0, 0.0]]\n'
_NO_UTF8 = b"h\xe9.csv".decode(errors="surrogateescape")

ROWS = [
    ("log report .", "a folder; a run's log is log.mcap"),
    ("log report nosuch.mcap", "nosuch.mcap: No such file"),
    ("log report flatt.npz", "flatt.npz: No such file or directory; did you mean flat.npz?"),
    ("animal analyse one.csvv", "one.csvv: no such recording or file; did you mean one.csv"),
    ("gait fit heigths.csv", "heigths.csv: no such file; did you mean heights.csv"),
    ("log report empty", "is not an MCAP log"),
    ("log replay .", "a folder; a run's log is log.mcap"),
    (f"animal capture {_NO_UTF8} -o t.npz", r"h\xe9.csv: this name is not UTF-8; rename the file"),
    (f"run --track {_NO_UTF8}", "this name is not UTF-8"),
    ("log compare nosuch.mcap", "nosuch.mcap: one log is compared with nothing"),
    ("log compare . .", "a folder; a run's log is log.mcap"),
    ("log compare empty empty --picture a.txt", "a.txt: a picture ends in .png, .svg, .pdf"),
    ("log compare empty empty --picture nosuch/a.png", "nosuch: no such folder"),
    ("plan nosuch", "nosuch: no such run; shipped are"),
    ("plan empty.toml", "empty.toml: name: is required"),
    ("plan pitch.toml", "robot pitch: has no yaw joint"),
    ("plan flat-square --robot one.toml", "has one yaw joint, but a walk needs two"),
    ("run flat-square --robot one.toml", "has one yaw joint"),
    ("plan broken.toml", "broken.toml:3: not TOML: "),
    ("plan types.toml", "types.toml:3: seed: must be a whole number (got '3')"),
    ("plan types.toml", "types.toml:4: world: must be text (got 7)"),
    (
        "plan flat-square --world lava.toml",
        "lava.toml:2: ground: kind 'lava' is unknown; use one of 'flat', ",
    ),
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
    ("animal fish synthesise p.npz --seconds nan", "--seconds: must be a finite number"),
    ("animal fish synthesise p.npz --merge inf", "--merge: must be a finite number"),
    ("animal fish synthesise p.npz --start 0,inf,0", "--start 0,inf,0: give X,Y,DEGREES"),
    ("plan flat-square --set run.cycle_hz=NaN", "cycle_hz=NaN: must be a finite number"),
    ("plan flat-square --set run.cycle_hz=inf", "cycle_hz: must be a number (got 'inf')"),
    ("init . --robot salamander", "has legs, which walk by gaits: snakewalk gait run trot"),
    ("init . --from nosuch", "nosuch: no such run; shipped are"),
    ("init . --robot typo.toml", "typo.toml:2: waypoints_m: unknown key"),
    ("init file.txt", "'file.txt' is a file"),
    ("tools schema nosuch", "kind: 'nosuch' is not one of 'run', 'robot', 'world'"),
    ("robot export yaw16 --urdf .", ".: is a folder; name a file"),
    ("tools schema run -o file.txt", "file.txt: exists; --force overwrites it"),
    ("run flat-square --out=", "nothing after --out: fill it"),
    ("run flat-square --out file.txt", "--out: 'file.txt' is a file"),
    ("gait run rolling --robot nosuch", "nosuch: no such robot"),
    ("animal track --picture nosuch/a.png", "nosuch: no such folder"),
    ("animal track --rate -5", "--rate -5.0: must be over 0"),
    ("animal track --rate nan", "--rate: must be a finite number (got nan)"),
    ("animal track --rate 30", "lamprey-like: its figures hold the frame rate"),
    ("animal analyse worm-like --rate 30", "worm-like: its figures hold the frame rate"),
    ("animal track one.csv", "one.csv: holds 1 frame"),
    ("animal track back.csv", "back.csv: t must increase from frame to frame"),
    ("animal track jump.csv", "it does not in 1 of 4 steps, first after frame 2"),
    ("animal track inf.csv", "11 of 55 rows lack one, or have one that is not finite"),
    ("animal track gaps.csv --time-unit s", "gaps: only 1 of 5 frames hold a midline"),
    ("animal track half.csv --time-unit s", "1 of 5 frame numbers are not whole numbers"),
    ("animal track far.csv", "its frames span 9000001; a track has at most 500000"),
    ("run --track far.csv", "its frames span 9000001; a track has at most 500000"),
    ("animal track nan.wcon", "nan.wcon: 1 of 2 times t are not finite numbers"),
    ("animal track bomb.npz", "bomb.npz: its 0.0197 MB would expand to 20 MB; at most 100 times"),
    ("run --track bomb.npz", "bomb.npz: its 0.0197 MB would expand to 20 MB; at most 100 times"),
    ("log report bomb.mcap", "bomb.mcap: its 0.00"),
    ("log replay deep.mcap", "deep.mcap: its /config is no JSON object, or is nested too deeply"),
    ("log export deep.mcap --csv nosuch/tables", "nosuch: no such folder"),
    ("log export deep.mcap --csv taken", "taken/pose.csv: exists; --force overwrites it"),
    ("gait tune rolling -o /proc/a.toml", "/proc: takes no file"),
    ("bus serve --servos 1 --record nosuch/a", "nosuch: no such folder"),
    ("bus serve --servos 1 --link nosuch/a", "nosuch: no such folder"),
    ("bus serve --servos 1 --link file.txt", "file.txt: "),
    ("bus serve --servos 1 --pace 0", "pace"),
    ("bus serve --servos 1 --latency -1", "must be finite and at least 0 ms"),
    ("bus serve --servos 1 --latency nan", "--latency: must be a finite number (got nan)"),
    ("bus serve --servos 1 --latency inf", "--latency: must be a finite number (got inf)"),
    ("bus serve --servos 1 --latency 1e9", "--latency 1e+09: must be at most 10000 ms"),
    ("bus serve --servos 1 --pace 1e9", "pace 1e+09: must be at most 1000; 1 is real time"),
    ("bus serve --servos 1 --for nan", "--for: must be a finite number (got nan)"),
    ("bus serve --servos 1 --for -1", "--for -1: must be over 0 s"),
    ("bus serve --servos 1 --record x --link x", "--record and --link have the same name"),
    ("gait run rolling --gamepad file.txt", "file.txt: is a file, not a gamepad; name one such as"),
    ("run flat-square --set run.waypoints_m=[[1e30,1]]", "waypoints_m.0.0: must be at most 1000"),
    ("ros --namespace ../x", "--namespace ../x: expected a name as snake"),
    ("world from high.csv -o w.toml --cell 0.1", "high.csv: holds heights of 3e+38 m"),
    ("bus sniff /dev/null", "/dev/null: is not a serial device; name one such as /dev/ttyUSB0"),
    ("bus sniff empty", "empty: holds no exchange"),
    ("bus sniff noise.bin", "noise.bin: holds no packet in 400 bytes"),
    ("trials run flat-slalom --robot nosuch --seeds 1", "nosuch: no such robot"),
    (
        "run flat-square --live",
        "--live: waypoints come from the page or from ROS; add --view or --ros",
    ),
    ("run flat-square --set run.seed", "--set run.seed: expected KEY=VALUE"),
    ("run flat-square --set run.seed=-1", "run flat-square: seed: "),
    ("run flat-square --set run.seed=1e999", "run flat-square: seed: "),
    ("plan flat-square --set run.sed=3", "sed: unknown key; did you mean seed? (got 3)"),
    ("plan flat-square --set seed=3", "did you mean run.seed?"),
    ("plan flat-square --set run.behavior.sliding=0", "did you mean behaviour?"),
    ("plan flat-square --set run.name=../x", "name: holds '/'"),
    ("plan flat-square --set robot.joint_axes=yxy", "must have the letters y and p only"),
    ("plan flat-square --set run.safety.stop_output=rts", "stop_output: must be rts:PORT, -rts:"),
    ('plan flat-square --set run.name=""', "name: must not be empty"),
    ("plan flat-slalom --with repertoire --set run.seed=3", "does not use --motion"),
    ("play worm-like --set run.robot=yaw16", "run.robot: is given by --robot"),
    ("play worm-like --set world.friction.along=-1", "world flat: friction.along: "),
    (
        "gait run rolling --set run.gait.parameters.waves=1",
        "run.gait.parameters.waves: is given by --param",
    ),
    ("gait run rolling --set robot.link_mas_kg=1", "did you mean link_mass_kg?"),
    ("trials run flat-slalom --seeds 1 --over run=3", "run: a key begins with run., robot."),
    ("trials run flat-slalom --seeds 1 --over run.seed=3 --over run.seed=4", "run.seed=V1,V2"),
    ("trials run flat-slalom --seeds 1 --world flat --world nosuch", "nosuch: no such world"),
    ("run flat-square --world flat --world ramp-10", "--world: given 2 times, but has one"),
    ("run flat-square --film --no-film", "--film: given 2 times"),
    ("run flat-square -o a --out b", "--out: given 2 times"),
    ("run flat-square --seed 1 --seed 2 --seed 1", "--seed: given 3 times"),
    ("gait run rolling --robot yaw16 --robot yaw16", "--robot: given 2 times"),
    ("gait run rolling -p lift_rad=0.1 --param lift_rad=0.2", "lift_rad has a value already"),
    ("plan flat-square --set run.seed=1 --set run.seed=2", "run.seed has a value already"),
    ("bus set --id 1 --id 2 --baud 57600", "--id: given 2 times"),
    ("trials run --track lamprey-like --track worm-like", "--track: given 2 times"),
    ("list --log-level info --log-level debug", "--log-level: given 2 times"),
    ("trials run flat-slalom --seeds 1 --track nosuch.npz", "nosuch.npz: no such recording"),
    ("trials run rolling --seeds 1 --track worm-like", "--track worm-like: is of walks"),
    ("trials run flat-slalom --seeds 1 --seconds 9", "--seconds 9: is of gaits"),
    ("plan flat-square --set run.start_m=[1e9,0]", "start_m.0: must be at most 1000"),
    ("plan flat-square --beam 4", "--beam, --out and --run belong to --with"),
    ("run flat-square --view --view-at 192.0.2.1", "192.0.2.1 is not an address of this machine"),
    ("run flat-square --view-at 127.0.0.1:99", "--view-at: is of the page: add --view"),
    ("run flat-square --no-film --look snake", "--look: is of the film, which --no-film leaves"),
    ("log report empty --no-film --fine", "--fine: is of the film"),
    ("list --quiet --verbose", "--verbose, --quiet and --log-level say the same thing"),
    ("log replay empty --out file.txt", "file.txt: exists; --force overwrites it"),
    ("log replay empty --out ./empty --force", "empty: is the log itself; give another name"),
    ("log replay empty --out nosuch/x.mcap", "nosuch: no such folder"),
    ("animal synthesise flat-square -o x --frames 100000000000", "--frames: must be at most "),
    ("animal synthesise flat-square -o x --set run.time_limit_s=1e12", "are over 300000 frames"),
    ("gait repertoire run list.json", "list.json: not a plan (no JSON object)"),
    ("gait repertoire run object.json", "object.json: not a plan ('format' is missing)"),
    ("world from cells.csv -o w.toml --cell 1e-300", "--cell: must be at least 1e-06"),
    ("world from heights.csv -o w.toml --cell 1e6", "a map of 1e+06 m at a scale of 1; the most"),
    ("robot import loop.urdf -o r.toml", "on which all hang: each hangs on another"),
    ("gait policy run wave-cma --seconds 1e12", "--seconds: must be at most "),
    ("gait policy learn -o p.toml --steps 1000000000000", "--steps: must be at most "),
    ("animal fish synthesise empty --seconds 1e12", "--seconds: must be at most "),
    ("pose camera flat-square --device 99", "camera 99: OpenCV cannot open it"),
    ("run flat-square --port rfc2217://", "expected rfc2217://HOST:PORT, as rfc2217://pi:5000"),
    ("run flat-square --port 1-8=sim,8-16=sim", "ports: ID 8 is on more than one"),
    ("run flat-square --port 1-8=sim", "ID 9, 10, 11, 12, 13, 14, 15, 16 is on none of them"),
    ("run flat-square --port robot", "the file of yaw16 has no [[ports]]"),
    ("run flat-square --port .", ".: is not a serial device"),
    ("run flat-square --pose imu", "pose: robot yaw16 has no IMU"),
    (
        "run pose.toml",
        "pose.toml:3: pose a guess: unknown; valid: camera, tags, ros, imu, joints, simulator, udp",
    ),
    ("plan pose.toml", "pose.toml:3: pose a guess: unknown"),
    ("trials run pose.toml --seeds 1", "pose a guess: unknown"),
    (
        "run flat-square --pose gps",
        "pose gps: unknown; valid: camera, tags, ros, imu, joints, simulator, udp",
    ),
    ("run flat-square --out /proc/x", "/proc/x: cannot be made"),
    ("run flat-square --log-file nosuch/x.log", "--log-file nosuch/x.log: No such file"),
    ("run flat-square --motion=", "nothing after --motion: fill it"),
    ("run flat-square --film=yes", "Option '--film' does not take a value"),
    ("run -", "-: no such run; shipped are"),
    ("run flat-square --set world.name=../x", "world flat: name: holds '/'"),
    ("run flat-square --set run.cycle_hz=100000", "cycle_hz: must be at most 1000"),
    (
        "plan flat-square --set robot.yaw_limit_rad=80",
        "must be at most 3.1 (got 80); 80 degrees are 1.396",
    ),
    ("plan flat-square --set run.start_m=[2000,1]", "(got 2000); 2000 mm are 2"),
    ("gait show lateral-undulation -p winding_rad=40", "40 degrees are 0.6981"),
    ("plan same.toml", "waypoints_m: no waypoint leads farther than 1 cm from start (0.00, 0.00)"),
    ("plan nan.toml", "nan.toml:2: waypoints_m.0.0: must be a finite number (got nan)"),
    ("plan flat-square --robot many.toml", "servo IDs would run to 600; the bus has 0 to 252"),
    ("gait run rolling --then x", "--then x: expected NAME@SECONDS"),
    ("gait run rolling --then rolling@nan", "gait.then.0.at_s: must be a finite number"),
    ("gait run rolling --look-at nan,nan", "gait.look_at_m.0: must be a finite number"),
    ("gait run rolling --robot yaw16", "gait rolling needs pitch joints"),
    ("gait run sidewinding --param lift_rad=five", "lift_rad: must be a number (got 'five')"),
    ("play worm-like --speed nan", "--speed nan: must be a finite number"),
    ("gait fit cells.csv", "cells.csv: no column x_m, y_m, z_m"),
    ("walk --graph ws:100:4:nan", "the rewired share must be from 0 to 1"),
    ("walk --graph er:100000000:9", "expected 4 to 1000000 states"),
    ("gait tune rolling --for beauty", "--for: 'beauty' is not one of 'speed', 'efficiency'"),
    ("gait tune trot --robot yaw16", "gait trot needs two pairs of legs"),
    ("gait run rolling --seconds 0", "--seconds: must be at least 0.1 (got '0')"),
    ("ros --seconds 0", "--seconds: must be at least 0.1 (got '0')"),
    ("gait tune rolling --seconds soon", "--seconds: must be a number (got 'soon')"),
    ("animal synthesise flat-square --frames 2.5", "--frames: must be a whole number (got '2.5')"),
    ("gait sweep rolling --seconds inf", "--seconds: must be a finite number"),
    (
        "gait sweep lateral-undulation rolling --robot yaw16 --points 1 -o one.csv",
        "one.csv: is not a table of `snakewalk gait sweep`",
    ),
    ("run flat-square --motion nosuch", "motion nosuch: unknown; valid: walk, "),
    ("run flat-square --port /dev/nosuch", "/dev/nosuch: no such port"),
    ("gait run rolling --param nosuch=1", "nosuch: unknown key"),
    ("play worm-like --set run.nosuch=1", "run worm-like: nosuch: unknown key"),
    ("plan flat-square --set world.nosuch=2", "world flat: nosuch: unknown key"),
    ("animal capture nosuch.mp4", "nosuch.mp4: no such video or folder of images"),
    ("pose board -o b.pdf --square nan", "--square: must be a finite number (got nan)"),
    ("pose markers -o m.pdf --side 1e9", "--side 1e+09: must be 10 to 1000 mm"),
    ("robot export yaw16 --urdf a.urdf --mjcf a.urdf", "two results have the same name"),
    ("bus serve --servos 5-1", "--servos 5-1: 5-1 runs backwards"),
    ("bus serve --servos 1 --imu 1", "--imu 1: a servo has this ID"),
    ("animal fish film file.txt", "file.txt: is a file; give a folder"),
    ("gait repertoire crowd -o c.txt", "c.txt: a film ends in .mp4"),
    ("plan --set world.ground.spacing_m=1e9", "spacing_m: must be at most 1 "),
    ("plan --set world.planner.slope_window_m=1e9", "slope_window_m: must be at most 10 "),
    ("plan --set world.planner.bend_radius_m=1e9", "bend_radius_m: must be at most 100 "),
    ("plan --set world.planner.node_spacing_m=1e-3", "node_spacing_m: must be at least 0.02 "),
    # commands that came later
    ("gait policy run nosuch", "nosuch: no such policy; shipped are wave-cma, wave-ppo"),
    ("gait policy run typo.toml", "typo.toml: robot: is required"),
    ("gait policy run wave-ppo --robot alternating16", "its network observes the joints of yaw16"),
    (
        "gait policy run wave-cma --set run.time_limit_s=9",
        "run.time_limit_s: is given by --seconds",
    ),
    ("gait policy learn -o new.txt", "new.txt: a policy's file ends in .toml"),
    ("gait policy learn -o /nosuch/a.toml", "/nosuch: no such folder"),
    ("trials policy nosuch --seeds 1", "nosuch: no such policy"),
    ("trials rehearse flat-square nosuch", "nosuch: no such run; shipped are"),
    ("view .", "a folder; a run's log is log.mcap"),
    ("view empty", "is not an MCAP log"),
    ("view empty --view-at 127.0.0.1:99999", "expected HOST or HOST:PORT, e.g. 127.0.0.1:8080"),
    ("stop nosuch", "nosuch: no such run is active"),
    ("run flat-slalom --set run.physics_step_s=1e-9", "physics_step_s: must be at least 2e-05"),
    ("run flat-slalom --set run.deviation.mass=0", "deviation.mass: must be over 0 (got 0)"),
    (
        "trials run flat-slalom --first-seed 99999999999999999999999",
        "--first-seed: must be at most ",
    ),
    ("stop nosuch --port /dev/nosuch", "stop: a run and --port exclude each other"),
    ("stop --port /dev/nosuch", "/dev/nosuch: no such port"),
    ("stop --port file.txt", "file.txt: is not a serial device; name one such as /dev/ttyUSB0"),
    ("stop --port /dev/nosuch --baud 123", "--baud 123: servos have 9600, 38400, 57600"),
    ("bus scan --port /dev/null", "/dev/null: is not a serial device"),
    ("doctor --port file.txt", "file.txt: is not a serial device"),
    ("log export nosuch.mcap", "choose what to write: --csv FOLDER, --parquet FOLDER"),
    ("log export empty --csv t", "is not an MCAP log"),
    ("log export empty --csv file.txt", "--csv: 'file.txt' is a file"),
    ("log export empty --foxglove a.txt", "a.txt: is an MCAP file; name it a.mcap"),
    (
        "log export empty --ros2 a.mcap --foxglove a.mcap",
        "two results have the same name",
    ),
    ("log export noise.bin --ros2 a.mcap", "noise.bin: is not an MCAP log"),
    ("robot identify noise.bin", "noise.bin: is not JSON"),
    ("robot identify list.json", "list.json: expected a JSON object"),
    ("robot identify list.json --no-fit", "--no-fit judges constants: give them with --start FILE"),
    ("robot identify list.json -o file.txt", "file.txt: exists; --force overwrites it"),
    ("robot identify list.json -o nosuch/a.json", "nosuch: no such folder"),
    ("robot identify nosuch.mcap", "nosuch.mcap: No such file"),
    ("robot identify nosuch.mcap list.json", "give one kind"),
    (
        "robot identify nosuch.mcap -o found.json",
        "found.json: friction is a world's file, which ends in .toml",
    ),
    ("robot identify list.json --world flat", "--world is the ground of a run's log"),
    ("world from nosuch.tif -o w.toml", "nosuch.tif: No such file"),
    ("world from noise.bin -o w.toml", "noise.bin: ends in none of .tif .tiff .asc"),
    ("world from text.png -o w.toml", "text.png: is no PNG"),
    (
        "world from cells.csv -o w.toml --cell 1",
        "line 2: column 1: expected a number or nothing, found 'x'",
    ),
    ("world from cells.csv -o w.toml --cell nan", "--cell: must be a finite number (got 'nan')"),
    ("world from cells.csv -o w.toml --scale -2", "--scale -2: must be from 1e-06 to 1e+06"),
    ("world from cells.csv -o w.toml --crop 1,2", "--crop 1,2: expected X0,Y0,X1,Y1"),
    ("world from cells.csv -o w.toml --crop 1,1,0,0", "X1 must be over X0, and Y1 over Y0"),
    ("world from cells.csv -o w.toml --unit parsec", "is not one of 'm', 'cm'"),
    ("world from cells.csv -o w.toml --up w", "is not one of 'z', 'y'"),
    ("world from cells.csv -o w.toml --point mode", "is not one of 'lowest', 'median'"),
    ("world from cells.csv -o w.txt", "w.txt: a world's file ends in .toml"),
    ("world from cells.csv -o one.toml", "one.toml: exists; --force overwrites it"),
    ("world from flat.npz -o w.toml", "holds no array named 'elevation', but z"),
    ("run --map lidar", "--map lidar: unknown; valid: world, stereo"),
    ("run --map stereo", "robot alternating16 has no stereo head"),
    ("world stereo a.png b.png --calibration no.yml -o w.toml", "no.yml: No such file"),
    (
        "world stereo a.png b.png --calibration empty -o w.toml --unit inch",
        "--unit: 'inch' is not one of",
    ),
    (
        "world stereo a.png b.png --calibration empty -o w.toml --height -1",
        "must be from 1e-06 to 1e+06",
    ),
    ("bus calibrate -o file.txt --port /dev/nosuch", "file.txt: a robot's file ends in .toml"),
    ("bus calibrate -o r.toml --port /dev/nosuch --current -1", "over 0 and at most 2 A"),
    (
        "bus calibrate -o r.toml --port /dev/nosuch --homing-offset",
        "a terminal is missing; add --yes",
    ),
    ("bus calibrate -o r.toml --port /dev/nosuch --yes", "--yes: goes with --homing-offset"),
    ("bus backup -o file.txt --port /dev/nosuch", "file.txt: exists; --force overwrites it"),
    ("bus backup -o a.json --port /dev/nosuch", "/dev/nosuch: no such port"),
    ("bus restore list.json --port /dev/nosuch", "list.json: expected a backup of servos"),
    ("bus restore noise.bin --port /dev/nosuch", "noise.bin: is not JSON"),
    ("bus restore deep.json --port /dev/nosuch", "deep.json: is not JSON"),
    ("bus restore /dev/zero --port /dev/nosuch", "/dev/zero: is larger than the 16 MB"),
    ("bus serve --play deep.json", "deep.json: line 1: no packet as bus serve --record writes it"),
    ("bus serve --play noise.bin", "noise.bin: is not an exchange of bus serve --record"),
    ("bus sniff deep.json", "deep.json: line 1: neither hex bytes nor a recorded packet"),
    ("robot identify deep.json", "deep.json: is not JSON"),
    ("gait repertoire run deep.json", "deep.json: not a plan (nested too deeply)"),
    ("robot import noise.bin -o r.toml", "noise.bin: is no XML: not well-formed"),
    ("robot import /dev/zero -o r.toml", "/dev/zero: is larger than the 16 MB that are read"),
    (
        "world stereo a.png b.png --calibration deep.yml -o w.toml",
        "deep.yml: is damaged: its decoder",
    ),
    ("gait repertoire play noise.bin", "noise.bin: not a repertoire"),
    ("gait repertoire play --speed nan", "--speed: must be a finite number (got nan)"),
    ("gait repertoire play --turn=-inf", "--turn: must be a finite number (got -inf)"),
    ("world from cells.csv -o w.toml --cell 1 --no-data nan", "must be a finite number"),
    ("ros --timeout=-inf", "--timeout -inf: expected seconds over 0, or inf"),
    ("gait repertoire play --seconds -1", "--seconds -1: must be over 0"),
    ("run salamander-square --robot yaw16", "gait trot needs two pairs of legs"),
    ("run salamander-square --motion walk", "a robot with legs runs gaits"),
    ("run salamander-square --track worm-like", "moves by a gait: leave --track out"),
    ("run salamander-square --set run.gait.name=rolling", "not steered along waypoints"),
    ("plan salamander-square --world ramp-10", "run it by: snakewalk run salamander-square"),
    ("gait run trot --robot yaw16", "gait trot needs two pairs of legs"),
    ("gait run trot --param turn=99", "turn: must be at most 1.6 (got 99)"),
    ("robot export yaw16", "choose what to write: --urdf FILE, --mjcf FILE, or both"),
    ("init file.txt/x", "file.txt/x: cannot be made: Not a directory"),
    ("tools schema", "kind: is required"),
    ("run --seed x", "--seed: must be a whole number (got 'x')"),
    ("gait run sidewinding --seconds abc", "--seconds: must be a number (got 'abc')"),
    ("trials run flat-slalom --seeds 0", "--seeds: must be at least 1 (got '0')"),
    ("run --log-level all", "--log-level: 'all' is not one of 'debug'"),
    ("gait policy learn", "--out: is required"),
    ("animal synthesise flat-square -o x --motion nosuch", "motion nosuch: unknown; valid: walk"),
    (
        "animal synthesise flat-square -o x --animal nosuch",
        "--animal nosuch: no such animal; shipped are",
    ),
    (
        "animal synthesise flat-square -o x --animal goat --motion kp",
        "--motion: is for snakes; --animal",
    ),
    ("animal synthesise flat-square -o x --animal nosuch.toml", "nosuch.toml: no such file"),
    ("animal synthesise flat-square -o x --look nosuch", "--look nosuch: needs --film or --glb"),
    ("nosuch", "No such command 'nosuch'"),
]


COSTS = {
    f"run flat-square {words}": pytest.mark.costs("imports what a run on a port or a page needs")
    for words in ("--view --view-at 192.0.2.1", "--port rfc2217://", "--port /dev/nosuch")
}


@pytest.mark.slow_cases(40, "243 commands in all")
@pytest.mark.fast_cases(30)
@pytest.mark.parametrize(
    ("words", "said"),
    [pytest.param(*row, id=row[0], marks=COSTS.get(row[0], ())) for row in ROWS],
)
def test_bad_input_is_told_and_nothing_is_written(
    words: str,
    said: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("taken").mkdir()
    for name, text in {
        "empty": "",
        "taken/pose.csv": "",
        "empty.toml": "",
        "file.txt": "mine",
        "path.toml": _RUN.replace("mine", "../../mine"),
        "typo.toml": f"{_RUN}cycle_herz = 50\n",
        "bom.toml": f"\ufeff{_RUN}cycle_herz = 50\n",
        "one.toml": 'name = "one"\njoint_axes = "y"\n',
        "broken.toml": f"{_RUN}seed = 3 4\n",
        "types.toml": f'{_RUN}seed = "3"\nworld = 7\n',
        "pose.toml": f'{_RUN}pose = "a guess"\n',
        "lava.toml": 'name = "w"\nground = { kind = "lava" }\n',
        "ground.toml": f"{_RUN}[ground]\n",
        "same.toml": 'name = "mine"\nwaypoints_m = [[0.0, 0.0]]\n',
        "nan.toml": 'name = "mine"\nwaypoints_m = [[nan, 0.0]]\n',
        "many.toml": f'name = "many"\njoint_axes = "{300 * "yp"}"\n',
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
        ("far.csv", np.arange(5) / 25, [0, 1, 2, 3, 9_000_000]),
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
    shown = capsys.readouterr()
    told = [line for line in shown.err.splitlines() if "snakewalk:" in line]
    assert end.value.code == 2
    assert not shown.out, "a result before its rejection"
    assert told
    assert any(said in line for line in told), told
    assert sorted(tmp_path.rglob("*")) == before
    assert Path("file.txt").read_text() == "mine"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "said"),
    [
        ("animal fish match film --build shark", "'shark' is not one of 'carp', 'eel'"),
        ("animal fish synthesise p.npz --reference bent", "is not one of 'straight', 'commonest'"),
        ("pose board -o a.pdf --pattern dots", "'dots' is not one of 'charuco', 'chessboard'"),
    ],
)
def test_a_choice_is_one_of_those_that_help_lists(
    words: str, said: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.argv", ["snakewalk", *words.split()])
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 2
    assert said in capsys.readouterr().err
