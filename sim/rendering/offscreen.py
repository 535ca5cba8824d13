"""Pictures without a screen: OSMesa if installed, else EGL."""

import atexit
import ctypes
import weakref
from functools import cache
from importlib import import_module
from typing import Any, Self

import mujoco
import numpy as np

from snakewalk.config.arrays import Image
from snakewalk.config.errors import InputError

_UNCLOSED_CONTEXTS: "weakref.WeakSet[Offscreen]" = weakref.WeakSet()
REMEDY = "apt-get install libosmesa6 (draws on the CPU), or libegl1 with a driver"


class OffscreenError(InputError):
    """No OpenGL that can draw without a screen."""


class Offscreen:
    """A frame buffer of one model; a context manager, or ``close`` it.

    Several may be open: each activates its OpenGL context before it draws or deletes.

    Raises:
        OffscreenError: neither OSMesa nor EGL works.

    """

    def __init__(self, model: mujoco.MjModel, width: int, height: int) -> None:
        model.vis.global_.offwidth, model.vis.global_.offheight = width, height
        self._gl = _context(width, height)
        self._gl.make_current()
        self._mjr = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_150)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._mjr)
        self._view = mujoco.MjrRect(0, 0, width, height)
        self._pixels = np.zeros((height, width, 3), np.uint8)
        self.close = weakref.finalize(self, _free_contexts, self._gl, self._mjr)
        """Free the frame buffer; safe to call twice."""
        self.close.atexit = False  # EGL may be gone by then
        _UNCLOSED_CONTEXTS.add(self)
        _free_at_exit()

    def draw(
        self, scene: mujoco.MjvScene, caption: str = "", size_px: tuple[int, int] | None = None
    ) -> Image:
        """Draw one frame, (height, width, 3), top row first; valid until the next one.

        ``size_px`` is the width and height of a smaller frame with the view of the scene's cameras.
        """
        width, height = size_px or (self._view.width, self._view.height)
        view = mujoco.MjrRect(0, 0, width, height)
        pixels = self._pixels.ravel()[: height * width * 3].reshape(height, width, 3)
        self._gl.make_current()
        mujoco.mjr_render(view, scene, self._mjr)
        if caption:
            mujoco.mjr_overlay(
                mujoco.mjtFont.mjFONT_NORMAL,
                mujoco.mjtGridPos.mjGRID_TOPLEFT,
                view,
                caption,
                "",
                self._mjr,
            )
        mujoco.mjr_readPixels(pixels, None, view, self._mjr)
        return pixels[::-1]

    def reload(self, model: mujoco.MjModel, texture: int) -> None:
        """Upload a changed texture of the model to the renderer."""
        self._gl.make_current()
        mujoco.mjr_uploadTexture(model, self._mjr, texture)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def plain_scene(model: mujoco.MjModel, geoms: int) -> mujoco.MjvScene:
    """Scene of at most ``geoms`` shapes, without reflections and shadows."""
    scene = mujoco.MjvScene(model, maxgeom=geoms)
    scene.flags[mujoco.mjtRndFlag.mjRND_REFLECTION] = 0
    scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = 0
    return scene


def _free_contexts(gl: Any, mjr: mujoco.MjrContext) -> None:
    gl.make_current()
    mjr.free()
    gl.free()


@cache
def _free_at_exit() -> None:
    """Have unclosed frame buffers freed at exit.

    Registered after MuJoCo's end of EGL and the end of finalizers, it runs before both.
    """
    atexit.register(_free_unclosed_contexts)


def _free_unclosed_contexts() -> None:
    for renderer in list(_UNCLOSED_CONTEXTS):
        renderer.close()


def _context(width: int, height: int) -> Any:
    """Make an OpenGL context; MuJoCo's choice by MUJOCO_GL is made at its import, too early."""
    faults = []
    for name, library, module in (
        ("OSMesa", "libOSMesa.so.8", "mujoco.osmesa"),
        ("EGL", None, "mujoco.egl"),
    ):
        try:
            if library is not None:
                ctypes.CDLL(library)
            return import_module(module).GLContext(width, height)  # the import loads OpenGL
        except (OSError, ImportError, AttributeError, RuntimeError) as error:
            faults.append(f"{name}: {error}")
    raise OffscreenError(
        f"films need an OpenGL that draws without a screen: {'; '.join(faults)}. Remedy: {REMEDY}"
    )
