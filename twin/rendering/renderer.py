"""Pictures by a graphics driver without a screen (EGL), where there is one; many times faster than casting rays.

`Frames` draws a model's states from one view; without a driver it casts rays (`raycaster`) and logs it once.
"""

import logging
from typing import Any, Literal

import mujoco
import numpy as np

from twin.errors import TwinError
from twin.rendering.raycaster import View, render

Renderer = Literal["auto", "egl", "rays"]
_GEOMS = 1000
_log = logging.getLogger(__name__)


class NoGraphics(TwinError):
    """No graphics driver that draws without a screen."""

    def __init__(self, reason: str) -> None:
        super().__init__(
            f"no OpenGL without a screen here ({reason}); install EGL (on Debian: libegl1 libgl1-mesa-dri) "
            "or cast rays on the processor: --renderer rays"
        )


class Frames:
    """Draws states of one model from one view; use it as a context."""

    def __init__(self, model: mujoco.MjModel, view: View, renderer: Renderer = "auto") -> None:
        """Open a driver's context.

        Args:
            model: Of the states to be drawn, with its shapes.
            view: Where from.
            renderer: `egl`, `rays`, or `auto`: the driver where there is one.

        Raises:
            NoGraphics: `egl` was asked for and there is none.
        """
        self._model, self._view = model, view
        self._context: tuple[Any, mujoco.MjrContext] | None = None
        if renderer != "rays":
            try:
                self._context = _open(model, view.size)
            except NoGraphics as error:
                if renderer == "egl":
                    raise
                _log.warning("%s; casting rays, about a second a picture", str(error).partition(";")[0])

    def __enter__(self) -> "Frames":
        return self

    def __exit__(self, *_: object) -> None:
        if self._context is not None:
            gl, drawn = self._context
            drawn.free()
            gl.free()
            self._context = None

    def draw(self, data: mujoco.MjData) -> np.ndarray:
        """Picture (height, width, 3) uint8 of a state whose kinematics are computed."""
        if self._context is None:
            return render(self._model, data, self._view)
        scene = mujoco.MjvScene(self._model, _GEOMS)
        option, mask = mujoco.MjvOption(), mujoco.mjtCatBit.mjCAT_ALL
        camera, hand = _camera(self._view), mujoco.MjvPerturb()
        mujoco.mjv_updateScene(self._model, data, option, hand, camera, mask, scene)
        width, height = self._view.size
        area, pixels = mujoco.MjrRect(0, 0, width, height), np.empty((height, width, 3), np.uint8)
        mujoco.mjr_render(area, scene, self._context[1])
        mujoco.mjr_readPixels(pixels, None, area, self._context[1])
        return np.flipud(pixels)


def _open(model: mujoco.MjModel, size: tuple[int, int]) -> tuple[Any, mujoco.MjrContext]:
    """A context of the driver and the model's meshes and colours in it."""
    try:
        from mujoco.egl import GLContext

        gl = GLContext(*size)
        gl.make_current()
        model.vis.global_.offwidth, model.vis.global_.offheight = size
        drawn = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, drawn)
    except (ImportError, AttributeError, OSError, RuntimeError, mujoco.FatalError) as error:
        raise NoGraphics(str(error).splitlines()[0]) from error
    return gl, drawn


def _camera(view: View) -> mujoco.MjvCamera:
    """A free camera where the view is; its field is the model's."""
    T, camera = view.T_lab_camera, mujoco.MjvCamera()
    forward = -T[:3, 2]
    camera.type, camera.distance = mujoco.mjtCamera.mjCAMERA_FREE, 1.0
    camera.lookat = T[:3, 3] + forward
    camera.azimuth = np.degrees(np.arctan2(forward[1], forward[0]))
    camera.elevation = np.degrees(np.arcsin(forward[2]))
    return camera
