"""HDF5 recordings: SLEAP's analysis and projects, DeepLabCut's table, Tierpsy, MATLAB 7.3."""

from pathlib import Path
from typing import Any

import h5py
import numpy as np
from numpy.typing import NDArray

from snakewalk.config.archive import check_expansion
from snakewalk.config.errors import InputError
from snakewalk.controller.track.choice import Choice
from snakewalk.controller.track.readers.arrays import track_from_arrays
from snakewalk.controller.track.readers.deeplabcut import load_group
from snakewalk.controller.track.readers.formats import KNOWN
from snakewalk.controller.track.readers.keypoints import Keypoints
from snakewalk.controller.track.readers.sleap import load_analysis, load_project
from snakewalk.controller.track.track import Track, frame_numbers, track_from_points

_TIERPSY = (
    ("coordinates/skeletons", "timeseries_data", "worm_index", "timestamp"),
    ("skeleton", "trajectories_data", "worm_index_joined", "frame_number"),
)
"""Bodies of Tierpsy (T, P, 2), their table, and its columns of animal and frame."""


def load_hdf5(file: Path, choice: Choice) -> Track | Keypoints:
    """Load any of these kinds; see ``load.load_file``."""
    try:
        with h5py.File(file, "r") as h5_file:
            sizes: list[int] = []
            elsewhere = h5_file.visititems_links(_linked_file) or h5_file.visititems(_other_file)
            if elsewhere is not None:
                raise InputError(f"{file}: {elsewhere}; copy it into this one")
            h5_file.visititems(lambda _, data: sizes.append(getattr(data, "nbytes", 0)))
            check_expansion(file, file.stat().st_size, sum(sizes))
            if "tracks" in h5_file and "track_occupancy" in h5_file:
                return load_analysis(file, h5_file, choice)
            if "metadata" in h5_file and "instances" in h5_file:
                return load_project(file, h5_file, choice)
            for places, table, *columns in _TIERPSY:
                if places in h5_file and table in h5_file:
                    return _tierpsy(file, h5_file[places], h5_file[table], columns, choice)
            tables = [g for g in h5_file.values() if _holds_table(g)]
            if tables:
                return load_group(file, tables[0], choice)
            if any(isinstance(g, h5py.Group) and "block0_values" in g for g in h5_file.values()):
                raise InputError(f"{file}: contains hand labels; use DeepLabCut's CSV of them")
            arrays = {
                name: _from_matlab(data)
                for name, data in h5_file.items()
                if isinstance(data, h5py.Dataset)
            }
    except (OSError, RuntimeError, TypeError) as error:  # TypeError: an unknown kind of link
        reason = str(error).splitlines()[0]
        raise InputError(f"{file}: is no HDF5 that can be read: {reason}; known: {KNOWN}") from None
    if not arrays:
        raise InputError(f"{file}: holds no arrays, and no table of DeepLabCut; known: {KNOWN}")
    choice.only(file, "a MATLAB file")
    return track_from_arrays(file, arrays, choice)


def _tierpsy(file: Path, places: Any, table: Any, columns: list[str], choice: Choice) -> Track:
    """Load bodies of one animal; the attributes of ``trajectories_data`` state units and rate.

    Bodies are in micrometres in a file of features, and in pixels in one of skeletons.
    """
    choice.only(file, "a file of Tierpsy", "individual")
    animal_names, frame = (table[column] for column in columns)
    names = list(map(str, np.unique(animal_names[animal_names >= 0])))
    is_animal = animal_names == int(choice.animal(file, names, names))
    about = places.file.get("trajectories_data", table).attrs
    stated = float(about.get("fps", about.get("expected_fps", 0.0)))
    rate_hz = choice.rate or (0.0 if "frames" in str(about.get("time_units")) else stated)
    if rate_hz <= 0.0:
        raise InputError(f"{file}: states no frame rate; give --rate")
    unit_m = 1e-6 if places.parent.name != "/" else 1e-6 * about.get("microns_per_pixel", 1)
    return track_from_points(
        file.stem,
        places[is_animal] * [1.0, -1.0],
        rate_hz,
        scale_m=None if "pixels" in str(about.get("xy_units", "pixels")) else unit_m,
        frame=frame_numbers(str(file), frame[is_animal].astype(float)),
    )


def _linked_file(name: str, link: object) -> str | None:
    return f"{name} is in {link.filename}" if isinstance(link, h5py.ExternalLink) else None


def _other_file(name: str, data: object) -> str | None:
    """Name of an array whose values are in other files (external storage or virtual)."""
    if not isinstance(data, h5py.Dataset):
        return None
    if data.external:
        return f"{name} is in {data.external[0][0]}"
    return f"{name} is a virtual array of other files" if data.is_virtual else None


def _holds_table(group: object) -> bool:
    return isinstance(group, h5py.Group) and isinstance(group.get("table"), h5py.Dataset)


def _from_matlab(data: h5py.Dataset) -> NDArray[np.generic]:
    """One variable: MATLAB's axes are reversed, and its text is numbers."""
    values = np.asarray(data[()])
    kind = data.attrs.get("MATLAB_class", b"")
    if kind == b"char":
        return np.array("".join(map(chr, values.ravel().tolist())))
    return values if kind == b"" else values.T
