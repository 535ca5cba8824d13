"""`make run` installs all extras, as the README promises."""

import re
import tomllib
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]


def test_the_development_extra_and_its_lock_contain_every_extra() -> None:
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"][
        "optional-dependencies"
    ]
    (named,) = re.findall(r"snakewalk\[([\w,]+)\]", " ".join(extras["dev"]))
    apart = {"dev", "warp"}  # `make warp` has an environment of its own
    assert set(named.split(",")) == set(extras) - apart
    locked = (ROOT / ".ci" / "locks" / "dev.txt").read_text().lower()
    for extra in ("c3d", "terrain"):
        for wanted in extras[extra]:
            name = re.match(r"[\w-]+", wanted)
            assert name is not None
            assert f"\n{name[0].lower()}==" in locked
