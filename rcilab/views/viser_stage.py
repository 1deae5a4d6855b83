"""Light, floor and camera of the page's 3D scene: the studio an arm is photographed in.

An environment map costs seconds of start-up on software rendering, so the stage lights the arm itself: soft light from
everywhere, a key light that throws the shadow, and a rim light that lifts white housings off a light background.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal

import numpy as np

from rcilab.views.scene import Color

if TYPE_CHECKING:
    import viser

BACKGROUND_LIGHT: tuple[Color, Color] = ((198, 208, 219), (250, 251, 252))
"""Top and bottom of the backdrop."""
BACKGROUND_DARK: tuple[Color, Color] = ((22, 25, 29), (52, 58, 66))

CAMERA_POSITION = (2.05, -1.75, 1.30)  # [m]
CAMERA_TARGET = (0.12, 0.0, 0.52)  # [m]
CAMERA_FOV = math.radians(38.0)  # [rad] vertical; viser's own 75 degrees bends an arm


def set_stage(server: viser.ViserServer, *, quality: Literal["full", "light"] = "full", dark: bool = False) -> None:
    """Lights the scene, lays the floor and places the camera that new pages start with.

    Args:
        server: The server of the page.
        quality: "light" leaves the shadows out, for browsers that render in software.
        dark: Whether the page is in dark mode.
    """
    scene = server.scene
    scene.configure_environment_map(hdri=None)
    scene.configure_default_lights(enabled=False)
    scene.add_light_hemisphere("/stage/sky", sky_color=(255, 255, 255), ground_color=(176, 184, 194), intensity=1.45)
    scene.add_light_directional(
        "/stage/key", color=(255, 250, 242), intensity=2.2, cast_shadow=quality == "full", position=(1.6, -2.2, 4.0)
    )
    scene.add_light_directional("/stage/fill", color=(226, 236, 255), intensity=0.55, position=(2.5, 2.5, 0.8))
    scene.add_light_directional("/stage/rim", color=(255, 255, 255), intensity=0.9, position=(-3.0, 1.0, 1.5))
    scene.add_grid(
        "/stage/floor",
        width=8.0,
        height=8.0,
        cell_size=0.1,
        cell_thickness=0.6,
        cell_color=(66, 72, 80) if dark else (226, 230, 235),
        section_size=0.5,
        section_thickness=0.9,
        section_color=(86, 94, 104) if dark else (200, 207, 215),
        plane_opacity=0.0,
        shadow_opacity=0.30 if dark else 0.16,
        fade_distance=7.0,
        position=(0.0, 0.0, -0.001),
    )
    scene.set_background_image(_gradient(*(BACKGROUND_DARK if dark else BACKGROUND_LIGHT)), format="png")
    camera = server.initial_camera
    camera.position = CAMERA_POSITION
    camera.look_at = CAMERA_TARGET
    camera.fov = CAMERA_FOV


def _gradient(top: Color, bottom: Color) -> np.ndarray:
    """Returns a narrow picture that fades from one colour to another, shape (256, 8, 3)."""
    column = np.linspace(top, bottom, 256)[:, None, :]
    return np.repeat(column, 8, axis=1).astype(np.uint8)
