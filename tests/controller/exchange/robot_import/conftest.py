"""Models of all tests are compiled in this process."""

from pathlib import Path

import mujoco
import pytest

from snakewalk.controller.exchange.robot_import import model_compiler


@pytest.fixture(autouse=True)
def compile_here(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without a process of its own, which imports MuJoCo again for half a second."""

    def compile_(source: Path, made: Path) -> str | None:
        try:
            mujoco.mj_saveModel(mujoco.MjModel.from_xml_path(str(source)), str(made), None)
        except ValueError as error:
            return str(error)
        return None

    monkeypatch.setattr(model_compiler, "compile_model", compile_)
