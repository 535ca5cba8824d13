"""Packages that a start does not wait for: they load when they are first used."""

import ast
from pathlib import Path

ROOT = Path(__file__).parents[2]
LATE = ("scipy.interpolate", "scipy.optimize", "scipy.signal", "scipy.spatial")
LATE_TOPS = ("matplotlib", "mujoco", "networkx", "cv2", "skimage", "av", "viser")


def imported_at_the_top(file: Path) -> set[str]:
    """Modules that a file imports when it is imported itself, with names of ``from`` imports."""
    names = set()
    for node in ast.parse(file.read_text(encoding="utf-8")).body:
        if isinstance(node, ast.Import):
            names |= {each.name for each in node.names}
        elif isinstance(node, ast.ImportFrom):
            names |= {str(node.module)} | {f"{node.module}.{each.name}" for each in node.names}
    return names


def loaded_with(module: str) -> dict[str, set[str]]:
    """Imports of a module's file and of all of ours that load with it, by module."""
    found: dict[str, set[str]] = {}
    waiting = [module]
    while waiting:
        name = waiting.pop()
        place = ROOT / Path(*name.removeprefix("snakewalk.").split("."))
        file = place / "__init__.py" if place.is_dir() else place.with_suffix(".py")
        if name in found or not file.is_file():
            continue
        found[name] = imported_at_the_top(file)
        waiting += [each for each in found[name] if each.startswith("snakewalk.")]
    return found


def test_a_gait_run_imports_nothing_heavy_before_it_needs_it() -> None:
    loaded = loaded_with("snakewalk.controller.run.commands.gait_run")
    assert len(loaded) > 200
    heavy = {
        module: bad
        for module, names in loaded.items()
        if (
            bad := {
                each
                for each in names
                if each.startswith(LATE) or each.split(".", maxsplit=1)[0] in LATE_TOPS
            }
        )
    }
    assert heavy == {}
