"""The loader reports every fault of a file at once, with where and what would be right."""

from pathlib import Path

import pytest

from snakewalk.config.errors import ConfigError
from snakewalk.config.loader import digest, load_robot, load_run, load_world, shipped


@pytest.mark.parametrize(
    ("kind", "loader"), [("robots", load_robot), ("worlds", load_world), ("runs", load_run)]
)
def test_every_shipped_file_loads_under_its_own_name(kind, loader) -> None:
    names = shipped(kind)
    assert names
    assert [loader(name).name for name in names] == list(names)


def test_shipped_runs_name_shipped_robots_and_worlds() -> None:
    for name in shipped("runs"):
        run = load_run(name)
        assert load_robot(run.robot)
        assert load_world(run.world)


def test_all_faults_of_a_file_come_at_once(tmp_path: Path) -> None:
    file = tmp_path / "bad.toml"
    file.write_text(
        'name = "x"\nwaypoints_m = [[1, 2]]\ncycle_hz = -5\nspeeed = 3\n[walk]\ncarrot_m = "far"\n'
    )
    with pytest.raises(ConfigError) as caught:
        load_run(str(file))
    lines = caught.value.faults
    assert len(lines) == 3
    assert all(line.startswith(f"{file}: ") for line in lines)
    text = "\n".join(lines)
    assert "cycle_hz" in text
    assert "speeed: unknown key" in text
    assert "walk.carrot_m" in text


@pytest.mark.parametrize("name", ["nosuch", "missing/file.toml"])
def test_missing_file_says_which(name: str) -> None:
    with pytest.raises(ConfigError, match=name):
        load_robot(name)


def test_broken_toml_says_where(tmp_path: Path) -> None:
    file = tmp_path / "torn.toml"
    file.write_text('name = "x\n')
    with pytest.raises(ConfigError, match="line 1"):
        load_world(str(file))


def test_a_chain_too_long_for_the_bus_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "long.toml"
    file.write_text(f'name = "long"\njoint_axes = "{"y" * 16}"\n[servo]\nfirst_id = 240\n')
    with pytest.raises(ConfigError, match="255"):
        load_robot(str(file))


def test_digest_changes_with_any_value() -> None:
    run = load_run("flat-square")
    assert digest(run) == digest(load_run("flat-square"))
    assert digest(run) != digest(run.model_copy(update={"seed": run.seed + 1}))
