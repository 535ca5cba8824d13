"""Actions recorded once for all tests here."""

import pytest

from snakewalk.config.loader import load_robot, load_world
from snakewalk.controller.repertoire.repertoire import Repertoire
from snakewalk.controller.repertoire.repertoire_recording import ACTIONS, record


@pytest.fixture(scope="session")
def repertoire() -> Repertoire:
    """All quick actions of yaw16 on the flat."""
    quick = tuple(action for action in ACTIONS if action.frequency_hz > 0.4)
    return record(load_robot("yaw16"), load_world("flat"), quick)
