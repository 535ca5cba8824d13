"""Policies beside gaits: the same start for the same seed, the numbers of a run's full rate."""

import json
from pathlib import Path

import numpy as np
import pytest

from snakewalk.controller.learning.policy_trials import PolicyTrial, _is_parameter_set, _prepare
from snakewalk.controller.run.factory import prepare_policy
from tests.helpers.command import snakewalk
from tests.helpers.in_process import work_in_this_process


def test_a_seed_moves_the_start_of_all_motions_alike() -> None:
    def drawn(motion: str, seed: int) -> tuple[float, float, float]:
        prepared = _prepare(PolicyTrial(motion, "flat", seed, 5.0))
        servo, friction = prepared.robot.servo, prepared.world.friction
        return prepared.start_heading_rad, friction.across, servo.supply_v

    assert drawn("wave-cma", 3) == drawn("lateral-undulation", 3)
    assert drawn("wave-cma", 3) != drawn("wave-cma", 4)
    usual = prepare_policy("wave-cma")
    assert abs(drawn("wave-cma", 3)[0]) <= 0.2
    assert drawn("wave-cma", 3)[1] == pytest.approx(usual.world.friction.across, rel=0.15)


def test_a_file_with_a_gait_is_a_set_of_its_parameters(tmp_path: Path) -> None:
    (tmp_path / "set.toml").write_text('# tuned\nname = "x"\ngait = "rolling"\n')
    (tmp_path / "policy.toml").write_text('name = "x"\nrobot = "yaw16"\n')
    assert _is_parameter_set(str(tmp_path / "set.toml"))
    assert not _is_parameter_set(str(tmp_path / "policy.toml"))
    assert not _is_parameter_set("wave-cma")


@pytest.mark.costs("trials of policies")
def test_the_table_has_a_row_for_each_motion_and_world(monkeypatch: pytest.MonkeyPatch) -> None:
    work_in_this_process(monkeypatch)
    words = ["wave-cma", "lateral-undulation", "wave-cma", "--seeds", "1", "--first-seed", "40"]
    done = snakewalk("trials", "policy", *words, "--seconds", "5", "--json", "-q")
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert len(found["trials"]) == 2  # what is given twice is run once
    learnt, gait = found["table"]
    assert [learnt["motion"], gait["motion"]] == ["wave-cma", "lateral-undulation"]
    assert learnt["trips"] == gait["trips"] == 0
    # the gait's figures of docs/gaits.md, with another friction
    assert gait["speed_m_s"] == pytest.approx(0.377, rel=0.05)
    assert gait["body_lengths_cycle"] == pytest.approx(0.633, rel=0.05)
    assert learnt["speed_m_s"] > 1.3 * gait["speed_m_s"]
    assert np.isfinite([trial["energy_j_m"] for trial in found["trials"]]).all()
