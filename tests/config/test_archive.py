"""Small files that would fill the memory are refused before they are unpacked."""

import io
import json
import struct
import tracemalloc
import warnings
import zipfile
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest
import trimesh
from mcap.writer import Writer
from PIL import Image as Pillow
from scipy.io import savemat

from snakewalk.config.archive import FREE_BYTES, check_expansion, read_arrays, read_bytes
from snakewalk.config.errors import InputError
from snakewalk.config.ground import _elevation_m
from snakewalk.controller.animals.fish.postures import load_postures
from snakewalk.controller.animals.mesh.body_model import read_silhouettes
from snakewalk.controller.cameras.lens import Lens
from snakewalk.controller.images.mesh_files import read_mesh
from snakewalk.controller.repertoire.repertoire import load_repertoire
from snakewalk.controller.runlog.reader import LogError, read_log
from snakewalk.controller.track.readers.load import load_track

MANY = 20_000_000
"""Bytes that each of these files would expand to, at least."""
MOST = 14_000_000
"""Bytes that refusing may take; a library imported at first use is part of it."""


def npz(path: Path) -> None:
    """An .npz whose directory says that it holds large arrays."""
    array = io.BytesIO()
    np.save(array, np.zeros(12_345, bool))
    with zipfile.ZipFile(path, "w") as archive:
        for name in ("points", "elevation", "about", "base"):
            archive.writestr(f"{name}.npy", array.getvalue())
    size = struct.pack("<I", array.tell())
    path.write_bytes(path.read_bytes().replace(size, struct.pack("<I", MANY)))


def lying_npz(path: Path) -> None:
    """An array whose header says more than there is."""
    header = io.BytesIO()
    said = {"descr": "<f8", "fortran_order": False, "shape": (MANY // 8,)}
    np.lib.format.write_array_header_1_0(header, said)
    with zipfile.ZipFile(path, "w") as archive:
        for name in ("points", "elevation", "about"):
            archive.writestr(f"{name}.npy", header.getvalue() + bytes(80))


def lying_zip(name: str) -> Callable[[Path], None]:
    """A member that unpacks to more than the directory says."""

    def make(path: Path) -> None:
        data = b'{"units": 0}' + b" " * MANY
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
            archive.writestr(name, data)
        held = path.read_bytes()
        path.write_bytes(held.replace(struct.pack("<I", len(data)), struct.pack("<I", 100)))

    return make


def wcon(path: Path) -> None:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
        archive.writestr("worm.wcon", '{"units": {}, "data": [' + "0," * (MANY // 2) + "0]}")


def lzma_wcon(path: Path) -> None:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_LZMA) as archive:
        archive.writestr("worm.wcon", b" " * FREE_BYTES)


def mat(path: Path) -> None:
    savemat(path, {"points": np.zeros(MANY // 8)}, do_compression=True)


def hdf5(path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    with h5py.File(path, "w") as file:
        file.create_dataset("points", (MANY,), "u1", chunks=True)  # nothing of it is stored


def log(path: Path) -> None:
    """A log of well packed rows."""
    with path.open("wb") as file:
        writer = Writer(file, chunk_size=MANY // 10)
        writer.start()
        channel = writer.register_channel("/config", "json", 0)
        for _ in range(MANY // 1_000_000 + 1):
            writer.add_message(channel, 0, b'{"a":[' + b"{}," * 333_333 + b"{}]}", 0)
        writer.finish()


def lying_log(path: Path) -> None:
    """A chunk that says little, and whose frame unpacks to much."""
    whole = path.with_name("whole")
    log(whole)
    data = bytearray(whole.read_bytes())
    at = 8
    while at < len(data):
        opcode, length = struct.unpack_from("<BQ", data, at)
        if opcode == 6:
            struct.pack_into("<Q", data, at + 9 + 16, 10)
        at += 9 + length if opcode != 2 else len(data)
    path.write_bytes(data)


def glb(said: dict[str, object], data: bytes = b"") -> Callable[[Path], None]:
    text = json.dumps({"asset": {"version": "2.0"}, **said}).encode()
    text += b" " * (-len(text) % 4)
    length = 12 + 8 + len(text) + (8 + len(data) if data else 0)
    packed = struct.pack("<4sII", b"glTF", 2, length) + struct.pack("<I4s", len(text), b"JSON")
    tail = struct.pack("<I4s", len(data), b"BIN\x00") + data if data else b""
    return lambda path: path.write_bytes(packed + text + tail) and None


def _accessor(count: int) -> dict[str, object]:
    return {"componentType": 5126, "type": "VEC3", "count": count}


_MESH = {"primitives": [{"attributes": {"POSITION": 0}}]}
zeros_glb = glb({"accessors": [_accessor(MANY // 12)], "meshes": [_MESH], "nodes": [{"mesh": 0}]})
shown_glb = glb(
    {
        "accessors": [_accessor(10_000)],
        "meshes": [_MESH],
        "nodes": [{"mesh": 0}] * (MANY // 120_000),
    }
)
views_glb = glb(
    {
        "buffers": [{"byteLength": 100_000}],
        "bufferViews": [{"buffer": 0, "byteLength": 100_000}] * (MANY // 100_000),
        "accessors": [],
    },
    bytes(100_000),
)

BOMBS = [
    (npz, "a.npz", load_track),
    (npz, "a.npz", load_repertoire),
    (npz, "a.npz", read_silhouettes),
    (npz, "a.npz", load_postures),
    (npz, "a.npz", lambda file: _elevation_m("mine", str(file))),
    (wcon, "a.wcon.zip", load_track),
    (mat, "a.mat", load_track),
    (hdf5, "a.h5", load_track),
    (log, "a.mcap", read_log),
    (zeros_glb, "a.glb", read_mesh),
    (shown_glb, "a.glb", read_mesh),
    (views_glb, "a.glb", read_mesh),
]
LIES = [
    (lying_npz, "a.npz", load_track),
    (lying_npz, "a.npz", load_repertoire),
    (lying_npz, "a.npz", lambda file: _elevation_m("mine", str(file))),
    (lying_zip("a.wcon"), "a.zip", load_track),
    (lying_zip("points.npy"), "a.npz", load_track),
    (lzma_wcon, "a.zip", load_track),
    (lying_log, "a.mcap", read_log),
]


def _refused(load: Callable[..., object], file: Path) -> str:
    """What a reader says of a file; it may take little memory to say so."""
    with pytest.raises(InputError):  # libraries are imported here, not where memory is counted
        load(str(file) if load is load_track else file)
    tracemalloc.start()
    try:
        with pytest.raises(InputError) as fault:
            load(str(file) if load is load_track else file)
        assert tracemalloc.get_traced_memory()[1] < MOST
    finally:
        tracemalloc.stop()
    assert len(fault.value.faults) == 1
    assert file.name in str(fault.value)
    return str(fault.value)


@pytest.mark.parametrize(("make", "name", "load"), BOMBS)
def test_what_would_expand_too_far_is_refused_before_it_is_unpacked(
    make: Callable[[Path], None], name: str, load: Callable[..., object], tmp_path: Path
) -> None:
    make(tmp_path / name)
    assert (tmp_path / name).stat().st_size < 2_000_000
    assert " MB would expand to " in _refused(load, tmp_path / name)


def test_what_has_no_end_is_not_read_to_it() -> None:
    with pytest.raises(InputError, match=r"/dev/zero: is larger than the 1 MB that are read"):
        read_bytes(Path("/dev/zero"), 1_000_000)
    with pytest.raises(InputError, match=r"/dev/zero: is a pipe or a device"):
        read_arrays(Path("/dev/zero"))


@pytest.mark.parametrize(
    "text",
    [
        "%YAML:1.0\n---\na: " + 99_999 * "[",
        "<opencv_storage>" + 99_999 * "<a>",
        "%YAML:1.0\n---\na: !!opencv-matrix\n   rows: 20000\n   cols: 20000\n   dt: d\n",
        '{"a": {"type_id": "opencv-matrix", "rows": 1, "cols": 99999999999999999999}}',
        "%YAML:1.0\n---\na: !!opencv-nd-matrix\n   sizes: [ 999, 999, 999 ]\n   dt: d\n",
    ],
    ids=["nested", "nested XML", "large", "too large for a number", "three axes"],
)
def test_a_calibration_that_opencv_would_crash_on_is_refused(text: str, tmp_path: Path) -> None:
    (tmp_path / "lens.yml").write_text(text)
    with pytest.raises(InputError, match=r"lens\.yml: (is damaged|cannot be read): "):
        Lens.read(tmp_path / "lens.yml")


def test_an_array_in_another_file_is_not_followed(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as held:
        held["group/tracks"] = h5py.ExternalLink("b.h5", "/tracks")
    with pytest.raises(InputError, match=r"a\.h5: group/tracks is in b\.h5; copy it into this one"):
        load_track(str(tmp_path / "a.h5"))


def test_arrays_whose_values_are_in_other_files_are_rejected(tmp_path: Path) -> None:
    (tmp_path / "secret").write_bytes(bytes(800))
    with h5py.File(tmp_path / "a.h5", "w") as held:
        held.create_dataset(
            "group/tracks", (10, 10), "f8", external=[(str(tmp_path / "secret"), 0, 800)]
        )
    with pytest.raises(InputError, match=r"a\.h5: group/tracks is in .*secret; copy it into this"):
        load_track(str(tmp_path / "a.h5"))
    layout = h5py.VirtualLayout((10, 10), "f8")
    layout[:] = h5py.VirtualSource(str(tmp_path / "c.h5"), "x", (10, 10))
    with h5py.File(tmp_path / "b.h5", "w") as held:
        held.create_virtual_dataset("tracks", layout)
    with pytest.raises(InputError, match=r"b\.h5: tracks is a virtual array of other files"):
        load_track(str(tmp_path / "b.h5"))


def test_a_table_that_is_a_group_is_none(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "a.h5", "w") as held:
        held["found/table"] = h5py.SoftLink("/found")
    with pytest.raises(InputError, match=r"a\.h5: holds no arrays"):
        load_track(str(tmp_path / "a.h5"))


def test_json_from_outside_is_parsed_in_one_place() -> None:
    """Elsewhere deep nesting would end the program: what is left reads rows of our own processes,
    or catches it.
    """
    own = {
        *("config/archive.py", "controller/runlog/reader.py"),
        *("controller/runlog/row_line.py", "controller/run/observer_process.py"),
        "drivers/safety/stop_button.py",
    }
    root = Path(__file__).parents[2]
    found = {
        str(file.relative_to(root))
        for room in ("config", "drivers", "sim", "controller")
        for file in (root / room).rglob("*.py")
        if "json.load" in file.read_text(encoding="utf-8")
    }
    assert found == own


@pytest.mark.parametrize(("make", "name", "load"), LIES)
def test_no_more_is_unpacked_than_a_file_says(
    make: Callable[[Path], None], name: str, load: Callable[..., object], tmp_path: Path
) -> None:
    make(tmp_path / name)
    _refused(load, tmp_path / name)


def test_the_limit_is_of_size_and_of_ratio() -> None:
    file = Path("a")
    check_expansion(file, 1, FREE_BYTES)
    check_expansion(file, 2_000_000, 200_000_000)
    check_expansion(file, 2_000_000, 40_000_000, text=True)
    for packed, unpacked, text in (
        (1, FREE_BYTES + 1, False),
        (2_000_000, 200_000_001, False),
        (2_000_000, 40_000_001, True),
        (2_000_000_000, 2_000_000_000, False),
        (400_000_000, 600_000_000, True),
    ):
        with pytest.raises(InputError, match="would expand to"):
            check_expansion(file, packed, unpacked, text=text)


def test_honest_arrays_come_back(tmp_path: Path) -> None:
    held = {
        "one": np.arange(12.0).reshape(3, 4),
        "fortran": np.asfortranarray(np.arange(6, dtype=np.int16).reshape(2, 3)),
        "word": np.array("worm"),
        "flat": np.zeros(FREE_BYTES // 8 - 100),
        "none": np.zeros((0, 3), bool),
    }
    for save in (np.savez, np.savez_compressed):
        save(tmp_path / "a.npz", **held)
        back, others = read_arrays(tmp_path / "a.npz")
        assert others == []
        assert list(back) == list(held)
        for name, values in held.items():
            assert np.array_equal(back[name], values)
            assert back[name].dtype == values.dtype
        back, others = read_arrays(tmp_path / "a.npz", {"word", "absent"})
        assert list(back) == ["word"]
        assert sorted(others) == sorted(held.keys() - {"word"})


def test_a_damaged_size_loses_no_more_than_its_chunk(tmp_path: Path) -> None:
    path = tmp_path / "a.mcap"
    log(path)
    data = bytearray(path.read_bytes())
    at, chunks = 8, 0
    while at < len(data):
        opcode, length = struct.unpack_from("<BQ", data, at)
        if opcode == 6:
            chunks += 1
            struct.pack_into("<Q", data, at + 9 + 16, 2**60 if chunks == 1 else 10)
        at += 9 + length if opcode != 2 else len(data)
    path.write_bytes(data)
    with pytest.raises(LogError, match="ends before its header"):
        read_log(path)


def test_a_mesh_with_pictures_of_too_many_pixels_is_refused(tmp_path: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", Pillow.DecompressionBombWarning)
        Pillow.new("1", (10_000, 9_000)).save(tmp_path / "skin.png")
        (tmp_path / "a.mtl").write_text("newmtl skin\nmap_Kd skin.png\n")
        solid = trimesh.creation.box()
        lines = ["mtllib a.mtl", *(f"v {x} {y} {z}" for x, y, z in solid.vertices)]
        lines += [f"vt {k % 2} {k // 2 % 2}" for k in range(8)]
        lines += ["usemtl skin", *(f"f {a}/{a} {b}/{b} {c}/{c}" for a, b, c in solid.faces + 1)]
        (tmp_path / "a.obj").write_text("\n".join(lines) + "\n")
        with pytest.raises(InputError, match="have 90 million pixels; at most 67 million"):
            read_mesh(tmp_path / "a.obj")
