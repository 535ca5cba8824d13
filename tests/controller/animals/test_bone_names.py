"""Every command that writes a moving glTF names each bone, so that an engine can retarget it."""

import re
from dataclasses import replace
from pathlib import Path

import pygltflib
import pytest
from typer.testing import CliRunner

from snakewalk.controller.animals.fish.fish_film import swim
from snakewalk.controller.animals.fish.model import fish_model
from snakewalk.controller.animals.fish.postures import save_postures
from snakewalk.controller.cli.command_line import app

SPINE = {"spine_00", "spine_01"}
LEGS = SPINE | {
    f"{bone}_{side}" for bone in ("upper_arm", "thigh", "hind_foot") for side in ("left", "right")
}
PERSON = {"pelvis", "head", "thigh_left", "thigh_right", "upper_arm_left", "upper_arm_right"}
SYNTHESIS = ("animal", "synthesise", "jacksboro-traverse", "--frames", "3", "--glb", "-o", "out")


def run(*words: str) -> None:
    done = CliRunner().invoke(app, words, catch_exceptions=False)
    assert done.exit_code == 0, done.stderr


@pytest.mark.slow_cases(9, "9 cases of 2 s of CPU")
@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (("animal", "body", "carp", "--animate", "carangiform", "-o", "out.glb"), SPINE),
        (("animal", "body", "worm-like", "--animate", "worm-like", "-o", "out.glb"), SPINE),
        (("animal", "body", "mesh.glb", "--animate", "thunniform", "-o", "out.glb"), SPINE),
        (("animal", "body", "fish.npz", "--animate", "fish.npz", "-o", "out.glb"), SPINE),
        (("animal", "people", "walk", "-o", "out.glb"), PERSON),
        (("animal", "people", "run", "-o", "out.glb"), PERSON),
        (SYNTHESIS, SPINE | {"tongue"}),
        ((*SYNTHESIS, "--animal", "lizard"), LEGS),
        ((*SYNTHESIS, "--animal", "goat"), LEGS),
    ],
)
def test_each_bone_has_a_name_of_its_own(
    words: tuple[str, ...], expected: set[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    if "mesh.glb" in words:
        run("animal", "body", "shark", "-o", "mesh.glb")
    save_postures(Path("fish.npz"), replace(swim(), model=fish_model("carp")))
    run(*words)
    written = pygltflib.GLTF2().load("out.glb")
    (skin,) = written.skins
    names = [written.nodes[joint].name for joint in skin.joints]
    assert len(set(names)) == len(names)
    assert [
        name for name in names if not name or re.fullmatch(r"(bone|joint|node)_?\d+", name)
    ] == []
    assert expected <= set(names)
    moved = {channel.target.node for channel in written.animations[0].channels}
    assert {written.nodes[node].name for node in moved} - {"root", "body"} <= set(names)
