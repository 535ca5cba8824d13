"""Every recorded animal: loads whole, is the animal that it is said to be, and suits a robot."""

from pathlib import Path

import pytest

from snakewalk.controller.capture.recording import ExaminedRecording, examine
from snakewalk.controller.run.factory import prepare_walk
from snakewalk.controller.track.choice import Choice

LAMPREY = "lamprey/lampreydata.csv"
FISH = "prickleback/XMUC02_Trial1_sleap-1.csv"
OMEGA = "worm-joint-angles/kymogram_omega-turn.npy"
DELTA = "worm-joint-angles/kymogram_delta-turn.npy"
WORM = "worm-images/skeletons.npz"


@pytest.fixture(scope="module")
def seen(shared_data: Path) -> dict[str, ExaminedRecording]:
    rates = {LAMPREY: None, FISH: 60.0, OMEGA: None, DELTA: None, WORM: None}
    return {
        name: examine(str(shared_data / name), choice=Choice(rate=rate))
        for name, rate in rates.items()
        if (shared_data / name).is_file()
    }


@pytest.mark.parametrize(
    ("name", "frames", "dropped", "rate_hz"),
    [
        (LAMPREY, 78, 2, 50.0),
        (FISH, 711, 0, 60.0),
        (OMEGA, 600, 0, 32.0),
        (DELTA, 300, 0, 32.0),
        (WORM, 169, 0, 30.0),
    ],
)
def test_every_recording_loads_whole_and_is_used(
    seen: dict[str, ExaminedRecording], name: str, frames: int, dropped: int, rate_hz: float
) -> None:
    facts = seen[name].facts
    assert (facts["frames"], facts["frames_left_out"]) == (frames, dropped)
    assert facts["rate_hz"] == pytest.approx(rate_hz)
    assert facts["head_and_tail_swapped"] == 0
    assert facts["energy_kept"] > 0.99
    assert facts["states_kept"] + sum(facts["states_refused"].values()) == frames
    assert facts["states_kept"] > 0.6 * frames


def test_the_lamprey_swims_as_published_and_must_be_slowed(
    seen: dict[str, ExaminedRecording],
) -> None:
    facts = seen[LAMPREY].facts
    assert 1 / facts["waves_on_body"] == pytest.approx(0.57, rel=0.15)  # wavelength, body lengths
    assert facts["wave_hz"] == pytest.approx(3.85, rel=0.02)
    assert facts["time_towards_head"] == 0.0
    assert facts["length_mm"] == pytest.approx(155, abs=2)
    assert facts["longer_if_slowed_where_needed"] == pytest.approx(5.0, rel=0.1)
    assert facts["times_no_load_speed"] > 3.0


def test_the_slow_fish_shakes_in_its_keypoints_more_than_it_moves(
    seen: dict[str, ExaminedRecording],
) -> None:
    facts = seen[FISH].facts
    assert facts["joint_speed_unsmoothed_rad_s"] > 20.0
    assert facts["joint_speed_rad_s"] < 3.0


def test_the_worms_reversals_are_seen(seen: dict[str, ExaminedRecording]) -> None:
    # read off the angle maps: the wave runs headwards from 6.3 to 10.6 s of 18.8
    assert seen[OMEGA].facts["time_towards_head"] == pytest.approx(4.3 / 18.75, abs=0.03)
    assert 0.1 < seen[DELTA].facts["time_towards_head"] < 0.4


@pytest.mark.parametrize("name", [LAMPREY, DELTA, WORM])
def test_walks_of_gentle_and_of_coiling_animals_reach_the_square_on_paper(
    shared_data: Path, name: str
) -> None:
    ahead = prepare_walk("flat-square", track=str(shared_data / name), seed=2).forecast()
    assert ahead.reached == 4
