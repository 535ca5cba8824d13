"""Each package keeps its budget of tokens."""

from pathlib import Path
from typing import Final

from tests.architecture.layout import ORDER
from tests.architecture.tokens import by_package, sizes, tokens

DECISIONS: Final = Path(__file__).resolve().parents[2] / "docs/decisions"
MOST: Final = 465_000
"""Tokens of all packages."""
LIMITS: Final = {
    "config": 19200,
    "drivers": 1500,
    "drivers.protocol": 3200,
    "drivers.port": 2500,
    "drivers.bus": 10050,
    "drivers.chain": 9700,
    "drivers.safety": 6700,
    "sim": 750,
    "sim.servo": 10400,
    "sim.line": 6000,
    "sim.faults": 1200,
    "sim.sniff": 1350,
    "sim.ax12": 2800,
    "sim.feetech": 3050,
    "sim.serve": 3700,
    "sim.physics": 13350,
    "sim.batch": 2550,
    "sim.rendering": 10050,
    "controller.kinematics": 2200,
    "controller.mechanics": 8700,
    "controller.shape": 2900,
    "controller.terrain": 11150,
    "controller.gaits": 6500,
    "controller.motion": 9700,
    "controller.runlog": 7450,
    "controller.walk": 12200,
    "controller.runtime": 4800,
    "controller.track": 15450,
    "controller.pose": 7600,
    "controller.metrics": 5300,
    "controller.console": 7150,
    "controller.images": 13750,
    "controller.figures": 3050,
    "controller.run": 21950,
    "controller.capture": 28850,
    "controller.animals": 46650,
    "controller.cameras": 20150,
    "controller.mapping": 19350,
    "controller.repertoire": 13600,
    "controller.bench": 20950,
    "controller.report": 5750,
    "controller.studies": 20600,
    "controller.rehearsal": 4050,
    "controller.view": 8550,
    "controller.exchange": 17100,
    "controller.ros": 4350,
    "controller.learning": 4350,
    "controller.cli": 2450,
}
"""Tokens of each package."""
RAISED: Final[dict[str, tuple[int, str]]] = {}
"""A larger limit of a package, and the file of the decision that names what left in exchange."""


def test_each_package_keeps_its_budget() -> None:
    limits = LIMITS | {name: limit for name, (limit, _) in RAISED.items()}
    counts = by_package(sizes())
    assert {n: count for n, count in counts.items() if count > limits.get(n, 0)} == {}, (
        "shorten these packages, or raise a limit by a decision that names what leaves"
    )
    assert counts.total() <= MOST


def test_each_package_has_a_limit_and_a_raised_one_its_decision() -> None:
    assert set(LIMITS) == {name for names in ORDER.values() for name in names}
    for name, (limit, page) in RAISED.items():
        assert limit > LIMITS[name]
        assert name in (DECISIONS / page).read_text(encoding="utf-8")


def test_layout_docstrings_and_comments_have_no_tokens() -> None:
    assert tokens('"""Text of\na module."""\n# note\nsum_m = (1.5e-3 +\n  rate_hz)  # x\n') == 3
    assert tokens("def f(a: int) -> None:\n    'no docstring by the style'\n") == 6
    assert tokens('say(f"{a} # {b[0]}", r"\\\\", \'"\', """in\nside""")') == 5
