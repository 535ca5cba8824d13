"""From a model's file to MuJoCo's model: expand xacro, prepare, compile within limits."""

import shutil
from importlib.util import find_spec
from pathlib import Path
from tempfile import TemporaryDirectory

import mujoco

from snakewalk.config.errors import Assumptions, InputError
from snakewalk.controller.console.child_process import run_limited, run_program
from snakewalk.controller.exchange.robot_import.mjcf_source import prepare_mjcf
from snakewalk.controller.exchange.robot_import.model_source import (
    LineElement,
    ModelSource,
    check_parts,
    parse,
    with_places,
)
from snakewalk.controller.exchange.robot_import.sdf_source import urdf_of_sdf
from snakewalk.controller.exchange.robot_import.urdf_source import prepare_urdf

_MOST_MEMORY_BYTES = 2_000_000_000
_MOST_CPU_S = 10
_MOST = _MOST_MEMORY_BYTES, _MOST_CPU_S
"""Limits of MuJoCo's compiler and of xacro: memory and CPU time (ours)."""
_REPORTED_EXIT = 3
_COMPILER = f"""
source, made = words
import mujoco
try:
    mujoco.mj_saveModel(mujoco.MjModel.from_xml_path(source), made, None)
except (ValueError, RuntimeError, MemoryError) as error:
    print(error or type(error).__name__)
    sys.exit({_REPORTED_EXIT})
"""
_XACRO = """
import xacro
sys.argv = words
xacro.main()
"""


def load_model(path: Path, assumed: Assumptions) -> tuple[mujoco.MjModel, ModelSource]:
    """Compile a URDF, a xacro, an SDF or a MuJoCo model.

    Raises:
        InputError: it cannot be read.

    """
    root, replaced = parse(path)
    notes = []
    if replaced:
        notes.append(f"{replaced} characters are not UTF-8; names that hold them differ")
    if any(element.tag.startswith("xacro:") for element in root.iter()):
        root, _ = parse(path, name="expanded xacro", text=_expanded_xacro(path))
        notes.append("xacro was run with its default arguments; lines are those of its output")
    check_parts(path, root)
    if root.tag == "sdf":
        root, lines = urdf_of_sdf(root, path)
        notes += lines
    if root.tag not in ("robot", "mujoco"):
        raise InputError(
            f"{path}: begins with <{root.tag}>, not with <mujoco> (MJCF), <robot> (URDF) or <sdf>"
        )
    if root.tag == "mujoco":
        source = prepare_mjcf(root, path, assumed)
        model, fault = _compiled_model(source)
    else:
        copy = _copied_element(root)
        source = prepare_urdf(root, path)
        model, fault = _compiled_model(source)
        if model is None and any(mesh.get("filename") for mesh in root.iter("mesh")):
            source = prepare_urdf(copy, path, meshes=False)  # one that MuJoCo cannot use
            model, fault = _compiled_model(source)
    if model is None:
        raise InputError(f"{path}: MuJoCo cannot read it: {fault}")
    source.notes[:0] = notes
    return model, source


def _copied_element(element: LineElement) -> LineElement:
    copy = LineElement(element.tag, dict(element.attrib))
    copy.file = element.file
    copy.line = element.line
    for child in element:
        assert isinstance(child, LineElement)
        copy.append(_copied_element(child))
    return copy


def _expanded_xacro(path: Path) -> str:
    """URDF of a xacro file, by the xacro that is installed.

    Raises:
        InputError: the program is missing, or cannot expand the file.

    """
    wait_s = 6.0 * _MOST_CPU_S
    try:
        if find_spec("xacro") is not None:
            ended = run_limited(_XACRO, "xacro", str(path), most=_MOST, timeout_s=wait_s)
        elif (program := shutil.which("xacro")) is not None:
            ended = run_program([program, str(path)], timeout_s=wait_s)
        else:
            raise InputError(
                f"{path}: is xacro, which needs the program xacro: pip install xacro, or write its "
                f"URDF elsewhere: xacro {path.name} > FILE.urdf"
            )
    except TimeoutError:
        raise InputError(f"{path}: xacro does not end") from None
    if ended.returncode or not ended.stdout.strip():
        lines = [line for line in ended.stderr.splitlines() if line.strip()]
        raise InputError(
            f"{path}: xacro cannot expand it: {lines[-1] if lines else 'no output'}; "
            "a file with $(find PACKAGE) needs the ROS environment of that package"
        )
    return ended.stdout


def _compiled_model(source: ModelSource) -> tuple[mujoco.MjModel | None, str]:
    """Compiled model, or None and MuJoCo's message with the user's lines."""
    text, places = source.text()
    with TemporaryDirectory() as folder:
        copy = Path(folder) / f"model.{source.root.tag}"
        compiled_file = Path(folder) / "model.mjb"
        copy.write_text(text, encoding="utf-8")
        said = compile_model(copy, compiled_file)
        if said is not None:
            return None, with_places(" ".join(said.split()), places)
        return mujoco.MjModel.from_binary_path(str(compiled_file)), ""


def compile_model(source: Path, compiled_file: Path) -> str | None:
    """Let MuJoCo compile a model in a process of its own; its message if it cannot, or None.

    A model may ask for any memory and time, and crash the compiler; that process is limited in all.
    """
    words = str(source), str(compiled_file)
    ended = run_limited(_COMPILER, *words, most=_MOST, folder=source.parent)  # its log is there
    if ended.returncode == _REPORTED_EXIT:
        return ended.stdout
    if ended.returncode or not compiled_file.is_file():
        return (
            f"its compiler gave up: {_MOST_MEMORY_BYTES / 1e9:g} GB of memory and {_MOST_CPU_S} s "
            "are enough for a robot's model"
        )
    return None
