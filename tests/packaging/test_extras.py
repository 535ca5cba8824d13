"""What `make run` and `make test` install."""

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
LOCKS = ROOT / ".ci" / "locks"


def locked(name: str) -> dict[str, str]:
    """Versions by package."""
    text = (LOCKS / f"{name}.txt").read_text().lower()
    return dict(re.findall(r"^([\w.-]+)==(\S+)", text, re.MULTILINE))


def test_the_development_extra_and_its_lock_contain_every_extra() -> None:
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"][
        "optional-dependencies"
    ]
    (named,) = re.findall(r"snakewalk\[([\w,]+)\]", " ".join(extras["dev"]))
    apart = {"dev", "warp"}  # `make warp` has an environment of its own
    assert set(named.split(",")) == set(extras) - apart
    for extra in ("c3d", "terrain"):
        for wanted in extras[extra]:
            name = re.match(r"[\w-]+", wanted)
            assert name is not None
            assert name[0].lower() in locked("dev")


def test_what_make_run_installs_is_a_part_of_what_make_test_installs() -> None:
    main = locked("main")
    assert {"mujoco", "viser", "opencv-python-headless", "setuptools"} <= set(main)
    assert main.items() <= locked("dev").items()
