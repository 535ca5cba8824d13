"""A printed board as a camera of known lens and place sees it."""

import cv2
import numpy as np

from snakewalk.config.arrays import Floats, Image
from snakewalk.controller.cameras.calibration_board import CalibrationBoard
from snakewalk.controller.cameras.lens import Lens

_DOTS = 50.0  # per inch: about as fine as the pictures
_WHITE = 1  # squares around the board
_TABLE = 90


def lens_rays(lens: Lens) -> Floats:
    """(3, N) where each pixel looks in the camera's axes, z = 1."""
    width, height = lens.size_px
    u, v = np.meshgrid(np.arange(width, dtype=float), np.arange(height, dtype=float))
    plain = lens.undistorted(np.stack([u, v], axis=-1))
    pixels = np.concatenate([plain, np.ones((*u.shape, 1))], axis=-1).reshape(-1, 3).T
    return np.asarray(np.linalg.solve(lens.matrix, pixels))


def board_picture(
    board: CalibrationBoard,
    lens: Lens,
    turn: Floats,
    place_m: Floats,
    *,
    noise: float = 2.0,
    seed: int = 0,
    rays: Floats | None = None,
) -> Image:
    """(H, W) grey.

    Args:
        board: what is printed.
        lens: of the camera.
        turn: (3,) rotation vector of the board in the camera's axes.
        place_m: (3,) its middle there.
        noise: standard deviation, grey levels.
        seed: of the noise.
        rays: those of ``lens_rays``, where many pictures are drawn.

    """
    print_ = board.picture(_DOTS)
    side = round(print_.shape[1] / board.squares[0])
    print_ = cv2.copyMakeBorder(
        print_, *[_WHITE * side] * 4, borderType=cv2.BORDER_CONSTANT, value=255
    )
    if rays is None:
        rays = lens_rays(lens)
    shape = lens.size_px[::-1]
    rotation = np.asarray(cv2.Rodrigues(turn)[0], dtype=float)
    far = (rotation[:, 2] @ place_m) / (rotation[:, 2] @ rays)
    on_board = rotation.T @ (far * rays - place_m[:, None])
    metres = board.square_m / side
    middle = 0.5 * np.array(print_.shape[::-1]) - 0.5
    x, y = ((on_board[k] / metres + middle[k]).reshape(shape).astype(np.float32) for k in (0, 1))
    seen = cv2.remap(
        print_, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_CONSTANT, borderValue=_TABLE
    )
    small = cv2.GaussianBlur(seen, (3, 3), 0.6).astype(float)
    grey = 25.0 + 0.8 * small + np.random.default_rng(seed).normal(0.0, noise, small.shape)
    return np.asarray(np.clip(np.rint(grey), 0.0, 255.0), dtype=np.uint8)


def board_pictures(
    board: CalibrationBoard, lens: Lens, count: int, seed: int = 0, rays: Floats | None = None
) -> list[Image]:
    """Pictures of a board that a hand holds at several places, distances and tilts."""
    chance = np.random.default_rng(seed)
    focal = float(lens.matrix[0, 0])
    rays = lens_rays(lens) if rays is None else rays
    out = []
    for k in range(count):
        far_m = chance.uniform(1.3, 2.2) * focal * board.size_m[0] / lens.size_px[0]
        reach = 0.3 * far_m * np.array(lens.size_px) / focal
        place = np.append(chance.uniform(-reach, reach), far_m)
        turn = np.append(chance.uniform(-0.6, 0.6, 2), chance.uniform(-0.4, 0.4))
        out.append(board_picture(board, lens, turn, place, seed=k, rays=rays))
    return out
