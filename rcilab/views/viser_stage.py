"""Light, ground, axes, background and camera of the page."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

if TYPE_CHECKING:
    import viser

_CAMERA, _LOOK_AT = (1.80, -1.85, 1.22), (0.17, 0.02, 0.49)  # [m]
_UP = (0.0, 0.0, 1.0)
_FIELD_OF_VIEW = 0.75  # [rad] from the upper edge to the lower one
_ROOM = 1.4  # [m] Width of the arm with the handles of its target.


def place_camera(server: viser.ViserServer) -> None:
    """Sets the initial camera of new pages, with the whole arm in view."""
    camera = server.initial_camera
    camera.position, camera.look_at, camera.fov = _CAMERA, _LOOK_AT, _FIELD_OF_VIEW


VIEWS: dict[str, tuple[float, float, float] | None] = {
    "home": None,
    "top": (-1e-3, 0.0, 1.0),
    "front": (1.0, 0.0, 0.0),
    "side": (0.0, -1.0, 0.0),
}
"""Where the camera of a view is, seen from the arm; from the top, x points up. None: the initial position."""


class ViserEnvironment:
    """The camera of a page: its initial position is farther away if the window or the panels leave little room.

    A camera that the user has moved is not changed until it is reset.

    Args:
        camera: Camera of a page that has just connected.
    """

    def __init__(self, camera: viser.CameraHandle) -> None:
        self._camera = camera
        self._view, self._placed = "home", np.array(_CAMERA)

        @camera.on_update
        async def _(_camera: object) -> None:
            if (
                self._view == "home"
                and self._is_at(self._placed, _CAMERA)
                and not self._is_at(camera_position(camera.aspect))
            ):
                self.reset()

    def reset(self, view: str = "home") -> None:
        """Moves the camera to its initial position, upright, or to that of another of `VIEWS`."""
        camera, self._view, self._placed = self._camera, view, camera_position(self._camera.aspect)
        direction = VIEWS[view]
        if direction is not None:
            away = np.linalg.norm(self._placed - np.array(_LOOK_AT))
            self._placed = np.array(_LOOK_AT) + away * np.array(direction)
        with camera.client.atomic():
            camera.position = self._placed
            camera.look_at = np.array(_LOOK_AT)
            camera.up_direction = _UP

    def _is_at(self, *positions: ArrayLike) -> bool:
        return any(np.allclose(self._camera.position, position, atol=1e-3) for position in positions)


def camera_position(aspect: float) -> np.ndarray:
    """Returns a camera position with the whole arm in view, base axes, shape (3,), [m].

    Args:
        aspect: Width over height of the visible part of the scene.
    """
    look_at = np.array(_LOOK_AT)
    behind = np.array(_CAMERA) - look_at
    width = 2.0 * np.linalg.norm(behind) * math.tan(0.5 * _FIELD_OF_VIEW) * aspect  # [m] Visible at the arm.
    return look_at + max(1.0, _ROOM / width) * behind


def add_environment(server: viser.ViserServer, *, full: bool, dark: bool = False, floor: float | None = 0.0) -> None:
    """Adds light, background, ground and base axes.

    Args:
        server: The page.
        full: Whether with shadows and reflections, which take seconds with software rendering.
        dark: Whether the page is dark.
        floor: Height of the ground in the base frame, [m]; None for none.
    """
    scene = server.scene
    scene.configure_default_lights(True, cast_shadow=full)
    scene.configure_environment_map("studio" if full else None, environment_intensity=0.55)
    scene.set_background_image(_backdrop(dark), format="jpeg", jpeg_quality=92)
    scene.add_light_ambient("/light", intensity=(0.22 if dark else 0.3) if full else 1.6)
    scene.add_grid(
        "/ground",
        width=4.0,
        height=4.0,
        cell_size=0.1,
        section_size=0.5,
        cell_color=(62, 70, 82) if dark else (196, 206, 218),
        section_color=(88, 100, 118) if dark else (150, 165, 184),
        cell_thickness=0.6,
        section_thickness=1.0,
        fade_distance=5.0,
        fade_strength=1.6,
        shadow_opacity=0.28 if full else 0.0,
        position=(0.0, 0.0, floor or 0.0),
        visible=floor is not None,
    )
    scene.add_frame("/base_axes", axes_length=0.22, axes_radius=0.004, origin_radius=0.006)


def _backdrop(dark: bool) -> np.ndarray:
    """Returns a soft vertical gradient as background of a white arm, (H, W, 3) uint8."""
    top, bottom = np.array([222.0, 231.0, 241.0]), np.array([250.0, 251.0, 253.0])
    if dark:
        top, bottom = np.array([20.0, 25.0, 33.0]), np.array([50.0, 58.0, 70.0])
    share = np.linspace(0.0, 1.0, 256)[:, None]
    return np.repeat(((1.0 - share) * top + share * bottom)[:, None, :], 16, axis=1).astype(np.uint8)
