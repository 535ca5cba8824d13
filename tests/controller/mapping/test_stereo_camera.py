"""Calibrations: written as people write them, rectified, and points that come back."""

import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from snakewalk.config.errors import InputError
from snakewalk.controller.mapping.elevation_choice import CalibrationChoice
from snakewalk.controller.mapping.stereo_camera import (
    StereoCalibration,
    read_calibration,
    rectify,
)

K = np.array([[400.0, 0.0, 160.0], [0.0, 400.0, 120.0], [0.0, 0.0, 1.0]])
TURN = cv2.Rodrigues(np.array([0.02, -0.03, 0.01]))[0]
T_M = np.array([-0.12, 0.004, -0.003])
D = np.array([-0.12, 0.03, 0.001, -0.0005, 0.0])


def opencv_file(file: Path, names=("K1", "D1", "K2", "D2", "R", "T"), t=T_M) -> Path:
    out = cv2.FileStorage(str(file), cv2.FILE_STORAGE_WRITE)
    for name, value in zip(names, (K, D, K, D, TURN, t), strict=True):
        out.write(name, np.asarray(value, dtype=float))
    out.release()
    return file


@pytest.mark.parametrize("ending", ["yml", "yaml", "xml", "json", "npz", "lists.json"])
def test_calibrations_are_read_by_the_names_people_use(ending: str, tmp_path: Path) -> None:
    names = ("cameraMatrix1", "distCoeffs1", "cameraMatrix2", "distCoeffs2", "R", "T")
    file = tmp_path / f"c.{ending}"
    if ending == "npz":
        np.savez(
            file, **dict(zip(names, (K, D[None], K, D, TURN, 1000 * T_M[:, None]), strict=True))
        )
    elif ending == "lists.json":
        values = (K, D, K, D, TURN, 1000 * T_M)
        lists = {name: value.tolist() for name, value in zip(names, values, strict=True)}
        file.write_text(json.dumps(lists | {"camera": "bench", "rms": 0.4}))
    else:
        opencv_file(file, names, 1000 * T_M)
    found = read_calibration(file, CalibrationChoice(unit="mm"))
    np.testing.assert_allclose(found.k_left, K)
    np.testing.assert_allclose(found.distortion_left, D)
    np.testing.assert_allclose(found.rotation, TURN)
    np.testing.assert_allclose(found.translation_m, T_M)


def test_points_come_back_through_distortion_and_rectification() -> None:
    """World points projected into both cameras; their rectified disparity gives them back."""
    rng = np.random.default_rng(4)
    points = rng.uniform([-0.3, -0.2, 1.0], [0.3, 0.2, 2.0], (40, 3))
    c = StereoCalibration(K, D, K, D, TURN, T_M, {})
    blank = np.zeros((240, 320), np.uint8)
    pair = rectify(c, blank, blank)
    assert pair.baseline_m == pytest.approx(np.linalg.norm(T_M))
    size = (320, 240)
    sides = cv2.stereoRectify(
        K, D, K, D, size, TURN, T_M[:, None], flags=cv2.CALIB_ZERO_DISPARITY, alpha=0
    )
    seen = []
    for rotation, t, turn, p in (
        (np.eye(3), np.zeros(3), sides[0], sides[2]),
        (TURN, T_M, sides[1], sides[3]),
    ):
        px, _ = cv2.projectPoints(points, cv2.Rodrigues(rotation)[0], t, K, D)
        seen.append(cv2.undistortPoints(px, K, D, R=turn, P=p)[:, 0])
    left, right = seen
    np.testing.assert_allclose(left[:, 1], right[:, 1], atol=1e-3)
    disparity = np.full((240, 320), np.nan)
    whole = np.rint(left).astype(int)
    for (u, v), value in zip(whole, left[:, 0] - right[:, 0], strict=True):
        disparity[v, u] = value
    found = pair.points_m(disparity)[whole[:, 1], whole[:, 0]]
    np.testing.assert_allclose(found[:, 2], points[:, 2], rtol=5e-3)
    np.testing.assert_allclose(found[:, :2], points[:, :2], atol=2.0 * 0.5 / 400 + 1e-3)


def test_rectified_pairs_of_middlebury_stay_as_they_are(tmp_path: Path) -> None:
    file = tmp_path / "calib.txt"
    file.write_text(
        "cam0=[994.978 0 311.193; 0 994.978 254.877; 0 0 1]\n"
        "cam1=[994.978 0 342.279; 0 994.978 254.877; 0 0 1]\ndoffs=31.086\nbaseline=193.001\n"
    )
    left = np.zeros((500, 741, 3), np.uint8)
    pair = rectify(read_calibration(file), left, left + 1)
    assert pair.left is left
    disparity = np.full((500, 741), 40.0)
    z = 994.978 * 0.193001 / (40.0 + 31.086)  # Z = f b / (d + doffs), of the data set's page
    points = pair.points_m(disparity)
    np.testing.assert_allclose(points[..., 2], z)
    np.testing.assert_allclose(
        points[100, 400, :2], [(400 - 311.193) * z / 994.978, (100 - 254.877) * z / 994.978]
    )


def test_lists_of_any_shape_and_opencvs_matrices_mix_in_json(tmp_path: Path) -> None:
    flat: dict[str, object] = {
        "K1": K.ravel().tolist(),
        "K2": [K.tolist()],
        "R": np.eye(3).tolist(),
    }
    flat |= {"T": T_M[:, None].tolist(), "D1": [0.1, 0.0, 0.0, 0.0]}
    file = tmp_path / "flat.json"
    file.write_text(json.dumps(flat))
    found = read_calibration(file)
    np.testing.assert_array_equal(found.k_left, K)
    np.testing.assert_array_equal(found.k_right, K)
    np.testing.assert_array_equal(found.translation_m, T_M)
    matrix = {
        "type_id": "opencv-matrix",
        "rows": 3,
        "cols": 3,
        "dt": "d",
        "data": K.ravel().tolist(),
    }
    file.write_text(json.dumps(flat | {"K1": matrix}))
    np.testing.assert_array_equal(read_calibration(file).k_left, K)
    packed = tmp_path / "packed.json"
    store = cv2.FileStorage(str(packed), cv2.FILE_STORAGE_WRITE_BASE64)
    for name, value in {"K1": K, "K2": K, "R": np.eye(3), "T": T_M}.items():
        store.write(name, value)
    store.release()
    assert "base64" in packed.read_text()
    np.testing.assert_array_equal(read_calibration(packed).k_right, K)


def test_what_is_no_calibration_is_refused(tmp_path: Path) -> None:
    def fault(name: str, text: str = "", **arrays) -> str:
        if arrays:
            np.savez(tmp_path / name, **arrays)
        else:
            (tmp_path / name).write_text(text)
        with pytest.raises(InputError) as caught:
            read_calibration(tmp_path / name)
        return str(caught.value)

    whole = {"K1": K, "K2": K, "R": np.eye(3), "T": T_M}
    assert "ends in .yml" in fault("a.toml")
    assert "a.yml: cannot be read: " in fault("a.yml", "not: [yaml")
    assert "K1 or M1" in fault("b.yml", "%YAML:1.0\n---\na: 3\n")
    assert "holds no K1 or M1" in fault("c.json", '{"R": [1, 2]}')
    assert "K1 is not a list of numbers or of rows" in fault("d.json", '{"K1": [[1, 2], [3]]}')
    assert "e.json: cannot be read as JSON: Expecting value: line 1 column 12" in fault(
        "e.json", '{"K1": [1, '
    )
    assert "l.json: lacks names of its matrices" in fault("l.json", "[1, 2]")
    text = '{"K1": "abc", "K2": [1], "R": [1], "T": [1]}'
    assert "K1 holds no numbers" in fault("t.json", text)
    text = text.replace('"abc"', "[1]").replace('"T": [1]', '"T": "x"')
    assert "T holds no numbers" in fault("t.json", text)
    assert "holds no K1" in fault("n.json", '{"K1": null, "R": [1]}')
    assert "it has R" in fault("n.json", '{"K1": null, "R": [1]}')
    assert "K1 has 2 numbers, not 9" in fault(
        "f.json", '{"K1": [1, 2], "K2": [1], "R": [1], "T": [1]}'
    )
    assert "not a calib.txt" in fault("c.txt", "cam0=[1 2]\n")
    assert "T has 2 numbers" in fault("d.npz", **(whole | {"T": T_M[:2]}))
    assert "R is no rotation" in fault("e.npz", **(whole | {"R": 2 * np.eye(3)}))
    assert "exchange the cameras" in fault("f.npz", **(whole | {"T": -T_M}))
    assert "K1 is not finite" in fault("g.npz", **(whole | {"K1": K * np.nan}))
    assert "no focal length" in fault("h.npz", **(whole | {"K2": -K}))
    assert "K1 holds no numbers" in fault("i.npz", **(whole | {"K1": np.full((3, 3), "a")}))
    assert "D1 has 3 coefficients" in fault("j.npz", **(whole | {"D1": np.zeros(3)}))
    assert "holds no T; it has" in fault("k.npz", **{k: v for k, v in whole.items() if k != "T"})
    np.savez(tmp_path / "ok.npz", **whole)
    held = read_calibration(tmp_path / "ok.npz")
    with pytest.raises(InputError, match="pictures of another size"):
        rectify(held, np.zeros((60, 80), np.uint8), np.zeros((60, 80), np.uint8))
    with pytest.raises(InputError, match="the pictures are"):
        rectify(held, np.zeros((240, 320), np.uint8), np.zeros((240, 321), np.uint8))
