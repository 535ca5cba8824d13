"""Optional packages: the extra that installs each, checked before work."""

from importlib.util import find_spec

from snakewalk.config.errors import InputError

EXTRAS = {
    "mujoco": ("MuJoCo", "sim"),
    "matplotlib": ("matplotlib", "view"),
    "mpl_toolkits": ("matplotlib", "view"),
    "plotly": ("Plotly", "view"),
    "jinja2": ("Jinja", "view"),
    "av": ("PyAV", "view"),
    "cv2": ("OpenCV", "vision"),
    "skimage": ("scikit-image", "vision"),
    "PIL": ("Pillow", "vision"),
    "h5py": ("h5py", "vision"),
    "ezc3d": ("ezc3d", "c3d"),
    "trimesh": ("trimesh", "vision"),
    "rasterio": ("Rasterio", "terrain"),
    "laspy": ("laspy", "terrain"),
    "lazrs": ("lazrs", "terrain"),
    "pygltflib": ("pygltflib", "vision"),
    "distributed": ("Dask", "sweep"),
    "dask": ("Dask", "sweep"),
    "gymnasium": ("Gymnasium", "gym"),
    "cma": ("cma", "learn"),
    "viser": ("viser", "page"),
    "rosbags": ("rosbags", "export"),
    "pyarrow": ("pyarrow", "export"),
    "rclpy": ("rclpy", "ros"),
    "warp": ("Warp", "warp"),
    "mujoco_warp": ("MuJoCo-Warp", "warp"),
}
"""Module to (name of the package, extra of ``pyproject.toml`` that brings it)."""
BASE = frozenset(
    {"numba", "scipy", "networkx", "typer", "rich", "mcap", "foxglove_schemas_protobuf"}
)
"""Modules of the base that a light install of the test fixture does without (docs/start/ci.md)."""


def require_extra(purpose: str, *modules: str) -> None:
    """Reject work that needs missing packages.

    ``purpose`` begins the sentence, with its verb: ``films need``. ``modules`` are keys of
    ``EXTRAS``.

    Raises:
        InputError: a package is missing; names the extra to install.

    """
    missing = [EXTRAS[module] for module in modules if find_spec(module) is None]
    if missing:
        names = " and ".join(dict.fromkeys(name for name, _ in missing))
        extras = ",".join(dict.fromkeys(extra for _, extra in missing))
        raise InputError(f"{purpose} {names}: pip install 'snakewalk[{extras}]'")


def missing_extra(error: ModuleNotFoundError) -> str | None:
    """Advice after a failed import; None for a module outside snakewalk's extras."""
    module = (error.name or "").partition(".")[0]
    if module in BASE:
        return f"this needs {module}, which a light install leaves out: pip install snakewalk"
    name, extra = EXTRAS.get(module, ("", ""))
    return f"this needs {name}: pip install 'snakewalk[{extra}]'" if extra else None
