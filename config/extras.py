"""The optional parts of the installation: which extra brings which package, asked before work."""

from importlib.util import find_spec
from typing import Final

from snakewalk.config.errors import InputError

EXTRAS: Final = {
    "mujoco": ("MuJoCo", "sim"),
    "matplotlib": ("matplotlib", "view"),
    "mpl_toolkits": ("matplotlib", "view"),
    "plotly": ("Plotly", "view"),
    "av": ("PyAV", "view"),
    "cv2": ("OpenCV", "vision"),
    "skimage": ("scikit-image", "vision"),
    "PIL": ("Pillow", "vision"),
    "h5py": ("h5py", "vision"),
    "ezc3d": ("ezc3d", "c3d"),
    "trimesh": ("trimesh", "vision"),
    "rasterio": ("Rasterio", "terrain"),
    "pygltflib": ("pygltflib", "vision"),
    "distributed": ("Dask", "sweep"),
    "dask": ("Dask", "sweep"),
    "gymnasium": ("Gymnasium", "gym"),
    "viser": ("viser", "page"),
    "rosbags": ("rosbags", "export"),
    "pyarrow": ("pyarrow", "export"),
}
"""Module to (name of the package, extra of ``pyproject.toml`` that brings it)."""


def require_extra(purpose: str, *modules: str) -> None:
    """Refuse what cannot be done without packages that are not installed.

    Args:
        purpose: beginning of the sentence, with its verb: ``films need``.
        modules: keys of ``EXTRAS``.

    Raises:
        InputError: one is not installed; says which extra to install.

    """
    missing = [EXTRAS[module] for module in modules if find_spec(module) is None]
    if missing:
        names = " and ".join(dict.fromkeys(name for name, _ in missing))
        extras = ",".join(dict.fromkeys(extra for _, extra in missing))
        raise InputError(f"{purpose} {names}: pip install 'snakewalk[{extras}]'")


def missing_extra(error: ModuleNotFoundError) -> str | None:
    """Return what to install after a failed import; None if no extra brings the module."""
    name, extra = EXTRAS.get((error.name or "").partition(".")[0], ("", ""))
    return f"this needs {name}: pip install 'snakewalk[{extra}]'" if extra else None
