"""``snakewalk animal synthesise``: a motion over hills on paper, and its recording."""

import json
from pathlib import Path

import cv2
import mujoco
import numpy as np
import pygltflib
import pytest
from scipy.spatial.transform import Rotation

from snakewalk.config.ground import build_ground
from snakewalk.config.loader import load_world, locate
from snakewalk.controller.animals.mesh.body_look import rig_look
from snakewalk.controller.animals.mesh.body_model import read_silhouettes
from snakewalk.controller.animals.mesh.rig import posed_m, spine_rig
from snakewalk.controller.animals.plots.snake_synthesis import draw_walk
from snakewalk.controller.animals.synthesis.snake_synthesis import SnakeSynthesis, SynthesisedWalk
from snakewalk.controller.animals.synthesis.synthesis_skin import FILM_SEGMENTS, SynthesisSkin
from snakewalk.controller.run.factory import prepare_playback, prepare_walk
from snakewalk.controller.track.readers.load import load_track
from snakewalk.sim.rendering.looks import Scene, dressed_model
from tests.helpers.command import snakewalk

BEHAVIOUR = """
name = "mine"
robot = "alternating16"
world = "jacksboro-gentle"
start_m = [-1.2, 0.9]
waypoints_m = [[0.5, 0.7]]

[synthesis]
sliding = [[0.0, 0.0], [2.0, 0.3]]
sliding_along = [0.5, 1.0]
pulse_spread_m_s = 0.02
head_held = 0.8
calm_tail = [[0.0, 0.0], [1.0, 0.5]]
tongue_speed = 2.0

[synthesis.waves]
long = 0.5
medium = 0.5
"""


@pytest.fixture(scope="module")
def traverse() -> SynthesisedWalk:
    return SnakeSynthesis(prepare_walk("jacksboro-traverse")).synthesise()


def test_heights_alone_are_the_cheap_way_onto_the_ground(traverse: SynthesisedWalk) -> None:
    keys = {"run.synthesis.ground": "height"}
    flat = SnakeSynthesis(prepare_walk("jacksboro-traverse", keys=keys)).synthesise()
    plan = flat.plan.points_m
    np.testing.assert_array_equal(flat.skeleton.points_m[..., :2], plan)
    assert len(plan) == len(traverse.plan.points_m)
    assert float(str(traverse.facts()["segments_stretched_most"])) == 0.0
    assert 0.005 < float(str(flat.facts()["segments_stretched_most"])) < 0.3


def test_all_waypoints_are_reached_on_the_ground(traverse: SynthesisedWalk) -> None:
    facts = traverse.facts()
    assert facts["waypoints_reached"] == facts["waypoints"] == 4
    points = traverse.skeleton.points_m
    step = np.linalg.norm(np.diff(points, axis=1), axis=2)
    np.testing.assert_allclose(step, step[0, 0], rtol=1e-9)  # no segment changes its length
    ground = build_ground(load_world("jacksboro-gentle"))
    assert ground is not None
    over = points[..., 2] - ground.elevation_m(points[..., 0], points[..., 1])
    np.testing.assert_allclose(over, np.broadcast_to(traverse.half_height_m, over.shape), atol=1e-9)
    assert 1.0 < np.degrees(traverse.skeleton.steepest_rad) < 40.0
    states = [state for _, state in traverse.states]
    assert len(set(states)) == len(states)  # a library of 630: none is taken twice in eight


def test_the_body_passes_where_its_head_passed(traverse: SynthesisedWalk) -> None:
    """The plan's tail at the end lies on the way of the head: nothing slides by default."""
    plan = traverse.plan.points_m
    way, tail = plan[:, 0], plan[-1, -1]
    assert np.hypot(*(way - tail).T).min() < 0.012


def test_the_same_seed_gives_the_same_motion_and_another_another() -> None:
    one, same, other = (
        SnakeSynthesis(prepare_walk("flat-slalom", seed=seed)).synthesise(60).plan.points_m
        for seed in (5, 5, 6)
    )
    np.testing.assert_array_equal(one, same)
    assert np.abs(one - other).max() > 0.01


def test_a_smaller_share_of_each_state_shows_more_of_them() -> None:
    """250 frames show fewer than three whole states."""
    made = {}
    for share in (None, 1.0, 0.25):
        keys = {} if share is None else {"run.synthesis.state_share": share}
        made[share] = SnakeSynthesis(prepare_walk("flat-slalom", keys=keys)).synthesise(250)
    whole, quarter = (len(made[share].states) for share in (1.0, 0.25))
    assert whole <= 3
    assert quarter >= 3 * whole
    np.testing.assert_array_equal(made[None].plan.points_m, made[1.0].plan.points_m)
    angles = made[0.25].plan.angles_rad
    assert np.abs(np.diff(angles, axis=1)).max() < 0.25  # no corner at a join


def test_aimed_as_printed_the_snake_leaves_its_path() -> None:
    """The mass centre lies half a body behind the place where the next state begins."""
    worst = []
    for motion in ("walk", "walk-printed"):
        made = SnakeSynthesis(prepare_walk("flat-slalom", motion=motion)).synthesise(850)
        centre = made.plan.points_m[::5].mean(axis=1)
        way = made.path.position(np.linspace(0.0, made.path.length_m, 300))
        gap = np.linalg.norm(centre[:, None] - way, axis=2).min(axis=1)
        worst.append(float(gap.mean()))
    assert worst[0] < 0.7 * worst[1]


@pytest.mark.slow
def test_the_command_writes_a_recording_that_other_commands_take(tmp_path: Path) -> None:
    (tmp_path / "mine.toml").write_text(BEHAVIOUR)
    words = [
        "animal",
        "synthesise",
        str(tmp_path / "mine.toml"),
        "-o",
        str(tmp_path / "out"),
        "--json",
    ]
    done = snakewalk(*words, "--frames", "120")
    assert done.returncode == 0, done.stderr
    facts = json.loads(done.stdout)
    assert facts["frames"] == 120
    assert (tmp_path / "out.png").read_bytes().startswith(b"\x89PNG")
    again = snakewalk(*words)
    assert again.returncode == 2
    assert "out.npz: exists" in again.stderr
    assert "out.png: exists" in again.stderr

    file = tmp_path / "out.npz"
    track = load_track(str(file))
    assert track.frames == 120
    assert track.rate_hz == 25.0
    assert track.length_m == pytest.approx(1.19, abs=0.03)  # in plan, on slopes
    assert read_silhouettes(file).radius.shape == (120, 101)
    with np.load(file) as held:
        assert held["height_m"].shape == (120, 101)
        assert held["tongue"].shape == held["state"].shape == (120,)
        assert 0.0 <= held["tongue"].min() < held["tongue"].max() <= 1.0
    assert prepare_playback(str(file)).joint_track[1].shape[1] == 16


def test_what_is_not_a_walk_is_refused(tmp_path: Path) -> None:
    done = snakewalk(
        "animal", "synthesise", "flat-square", "--motion", "serpenoid", "-o", str(tmp_path / "x")
    )
    assert done.returncode == 2
    assert "--motion serpenoid: choose walk, walk-printed, kp" in done.stderr
    assert not list(tmp_path.iterdir())


@pytest.mark.slow
def test_the_bones_lie_on_the_skeleton_and_the_film_draws_the_posed_skin(
    traverse: SynthesisedWalk,
) -> None:
    prepared = prepare_walk("jacksboro-traverse")
    worn = SynthesisSkin.of("animal", prepared.run.track, prepared.robot)
    bones = traverse.bones(FILM_SEGMENTS)
    points = traverse.skeleton.points_m
    ends = bones.front_m + bones.bone_m[:, None] * bones.rotation[..., 0] * -1.0
    np.testing.assert_allclose(bones.front_m, points[:, :-1:FILM_SEGMENTS])
    np.testing.assert_allclose(ends, points[:, FILM_SEGMENTS::FILM_SEGMENTS], atol=2e-3)  # bent

    look = rig_look(spine_rig(worn.skin, bones.bone_m), worn.dressed.texture)
    model = dressed_model(Scene(prepared.robot, prepared.world, prepared.ground), look=look)
    assert model.nbody == 1 + len(bones.bone_m)  # the robot's links are gone
    data, scene = mujoco.MjData(model), mujoco.MjvScene(model, maxgeom=1000)
    frame = 300
    turns = Rotation.from_matrix(bones.rotation[frame]).as_quat(scalar_first=True)
    data.qpos[:] = np.hstack([bones.front_m[frame], turns]).ravel()
    mujoco.mj_kinematics(model, data)
    option, camera = mujoco.MjvOption(), mujoco.MjvCamera()
    mujoco.mjv_updateScene(model, data, option, None, camera, mujoco.mjtCatBit.mjCAT_ALL, scene)
    drawn = np.array(scene.skinvert).reshape(-1, 3)
    np.testing.assert_allclose(
        drawn, posed_m(spine_rig(worn.skin, bones.bone_m), bones, frame), atol=3e-6
    )


def test_rings_turn_green_when_the_mass_centre_is_there(traverse: SynthesisedWalk) -> None:
    run = prepare_walk("jacksboro-traverse").run
    times = traverse.reached_s()
    assert len(times) == 4
    assert times == sorted(times)
    for time_s, waypoint in zip(times, run.waypoints_m, strict=True):
        centre = traverse.plan.points_m[round(time_s * traverse.rate_hz)].mean(axis=0)
        assert np.hypot(*(centre - waypoint)) < run.waypoint_radius_m


@pytest.mark.nightly("a film of a skin: 4 s of CPU")
def test_film_and_skin_are_written_beside_the_recording(tmp_path: Path) -> None:
    words = [
        "animal",
        "synthesise",
        "jacksboro-traverse",
        "--frames",
        "4",
        "-o",
        str(tmp_path / "out"),
    ]
    wrong = snakewalk(*words, "--look", "shark")
    assert wrong.returncode == 2
    assert "--look shark: needs --film or --glb" in wrong.stderr
    unknown = snakewalk(*words, "--glb", "--look", "unicorn")
    assert unknown.returncode == 2
    assert not list(tmp_path.iterdir())  # refused before any work
    done = snakewalk(*words, "--film", "--glb", "--look", "eel", "--json")
    assert done.returncode == 0, done.stderr
    facts = json.loads(done.stdout)
    assert Path(facts["film"]).read_bytes()[4:8] == b"ftyp"
    skin = Path(facts["skin"])
    assert skin.read_bytes().startswith(b"glTF")
    held = pygltflib.GLTF2().load(str(skin))
    assert len(held.skins[0].joints) >= 100
    names = [held.nodes[joint].name for joint in held.skins[0].joints]
    assert names[3] == "spine_03"
    assert len(set(names)) == len(names)
    assert held.accessors[held.animations[0].samplers[0].input].count == 4


@pytest.mark.slow
def test_the_older_graph_of_states_keeps_the_snake_on_its_path() -> None:
    prepared = prepare_walk("jacksboro-traverse", motion="kp", on_paper=True)
    made = SnakeSynthesis(prepared).synthesise()
    assert made.complete
    centre = made.plan.points_m[::10].mean(axis=1)
    way = made.path.position(np.linspace(0.0, made.path.length_m, 3000))
    assert np.linalg.norm(centre[:, None] - way, axis=2).min(axis=1).max() < 2e-3
    assert made.facts()["bend_k_rad"] > 0.3  # type: ignore[operator]


@pytest.mark.slow_cases(1, "3 cases of 1.9 s of CPU")
@pytest.mark.slow
@pytest.mark.parametrize("how", [["--motion", "walk"], ["--motion", "kp"], ["--animal", "lizard"]])
def test_frames_beyond_the_path_end_at_the_edge_of_the_map(how: list[str], tmp_path: Path) -> None:
    """All 600 frames were made, on the height of the border."""
    keys = ("world.ground.size_m=3.0", "run.start_m=[0.0,0.0]", "run.waypoints_m=[[0.5,0.0]]")
    sets = [word for key in keys for word in ("--set", key)]
    done = snakewalk(
        *("animal", "synthesise", "flat-slalom", *how, *sets, "--frames", "600", "--json"),
        *("-o", str(tmp_path / "out")),
    )
    assert done.returncode == 0, done.stderr
    made = json.loads(done.stdout)["frames"]
    assert 10 < made < 600
    warning = f"--frames 600: the motion ends after {made} frames, where the head leaves the ground"
    assert warning in done.stderr
    head_m = np.abs(load_track(str(tmp_path / "out.npz")).points[:, 0]).max(axis=1)
    assert head_m[-1] > 1.5 >= head_m[:-1].max()


@pytest.mark.slow
def test_frames_do_not_end_a_motion_before_the_last_waypoint(tmp_path: Path) -> None:
    """The head left the floor 18 frames before the middle of the body reached the waypoint."""
    words = [
        "animal",
        "synthesise",
        "flat-slalom",
        "--json",
        "-o",
        str(tmp_path / "out"),
        "--frames",
        "3000",
    ]
    facts = json.loads(snakewalk(*words).stdout)
    assert facts["waypoints_reached"] == 5
    assert facts["frames"] < 3000


def test_a_motion_on_paper_is_refused_as_a_run() -> None:
    done = snakewalk("run", "jacksboro-traverse", "--motion", "kp")
    assert done.returncode == 2
    assert "kp is a motion on paper: snakewalk animal synthesise" in done.stderr


@pytest.mark.nightly("a further film: 2 s of CPU")
def test_an_animal_with_legs_is_led_over_the_hills(tmp_path: Path) -> None:
    out = tmp_path / "lizard"
    run = ["animal", "synthesise", "jacksboro-traverse", "--animal", "lizard", "-o", str(out)]
    done = snakewalk(*run, "--json")
    assert done.returncode == 0
    facts = json.loads(done.stdout)
    assert facts["waypoints_reached"] == facts["waypoints"] == 4
    assert facts["slip_most_m"] < 1e-9
    assert facts["leg_short_most_m"] < 1e-3
    assert facts["speed_m_s"] == pytest.approx(0.133 / 0.256, rel=1e-3)
    assert facts["seconds"] == pytest.approx(facts["path_m"] / facts["speed_m_s"], rel=0.05)
    with np.load(out.with_suffix(".npz")) as held:
        assert held["foot_m"].shape == (facts["frames"], 4, 3)
        assert held["on_ground"].mean() == pytest.approx(16 / 24, abs=0.01)  # 63 % of 24 frames
    assert out.with_suffix(".png").stat().st_size > 10_000
    track = load_track(str(out.with_suffix(".npz")))  # the spine is a recording as any other
    assert track.frames == facts["frames"]
    again = snakewalk(*run)
    assert again.returncode == 2
    assert "--force" in again.stderr


@pytest.mark.slow
def test_an_animal_of_ones_own_is_filmed_and_written_as_gltf(tmp_path: Path) -> None:
    own = locate("animals", "goat").read_text().replace("length_m = 1.25", "length_m = 0.5")
    (tmp_path / "kid.toml").write_text(own.replace('skin = "goat"', 'skin = "own.toml"'))
    (tmp_path / "own.toml").write_text(locate("skins", "goat").read_text())
    out = tmp_path / "kid"
    done = snakewalk(
        *(
            "animal",
            "synthesise",
            "flat-square",
            "--animal",
            str(tmp_path / "kid.toml"),
            "-o",
            str(out),
        ),
        *("--frames", "12", "--glb", "--film", "--json"),
    )
    assert done.returncode == 0
    assert json.loads(done.stdout)["frames"] == 12
    tree = pygltflib.GLTF2().load(str(out.with_suffix(".glb")))
    assert len(tree.skins[0].joints) == 24 + 18 + 1  # spine, legs, and the beard that swings
    assert out.with_suffix(".mp4").stat().st_size > 1000


@pytest.mark.nightly("a further film: 2 s of CPU")
def test_the_feet_as_printed_are_an_option_and_their_slip_is_reported(tmp_path: Path) -> None:
    words = ["animal", "synthesise", "flat-square", "--frames", "40", "--json"]
    slip = {}
    for feet in ("footfall", "gc-printed"):
        out = ["-o", str(tmp_path / feet), "--animal", "goat", "--feet", feet]
        done = snakewalk(*words, *out)
        assert done.returncode == 0, done.stderr
        facts = json.loads(done.stdout)
        assert facts["feet"] == feet
        slip[feet] = facts["slip_stance_most_m"]
    assert slip["footfall"] < 1e-6
    assert slip["gc-printed"] > 0.1
    for wrong, message in (
        (["--animal", "goat", "--feet", "round"], "'round' is not one of 'footfall', 'gc-printed'"),
        (["--feet", "footfall"], "add --animal"),
    ):
        done = snakewalk(*words, "-o", str(tmp_path / "x"), *wrong)
        assert done.returncode == 2
        assert message in done.stderr


def test_the_older_graph_mixes_random_states_and_moves_sideways() -> None:
    """The walk of [PT] slides less: its mass centre may leave the path."""
    facts = {
        motion: SnakeSynthesis(prepare_walk("flat-slalom", motion=motion, on_paper=True))
        .synthesise(400)
        .facts()
        for motion in ("walk", "kp")
    }
    assert facts["kp"]["states_random"] > 20  # type: ignore[operator]
    assert facts["walk"]["states_random"] > 0  # type: ignore[operator]
    assert facts["kp"]["sideways_share"] > 4.0 * facts["walk"]["sideways_share"]  # type: ignore[operator]


@pytest.mark.slow
def test_the_title_of_a_long_narrow_map_is_whole(tmp_path: Path) -> None:
    """The map pushed its title over the edge of the picture."""
    made = SnakeSynthesis(prepare_walk("flat-slalom", motion="kp", on_paper=True)).synthesise()
    draw_walk(made, None, tmp_path / "a.png", "flat-slalom: flat")
    picture = cv2.imread(str(tmp_path / "a.png"))
    assert picture is not None
    is_blank = (picture == 255).all(axis=(1, 2))
    assert is_blank[:2].all()  # above the title
    assert is_blank[250:350].any()  # between the label of the map and the titles below it
