"""Where a page's camera stands: far enough back for the arm, left alone once it was moved, brought back on demand."""

from __future__ import annotations

import asyncio
from contextlib import nullcontext
from types import SimpleNamespace

import numpy as np

from rcilab.views.viser_stage import ViserEnvironment, camera_position

LOOK_AT = np.array((0.17, 0.02, 0.49))  # [m] The middle of the arm.


def some_camera(aspect: float = 2.0) -> SimpleNamespace:
    """A camera as viser hands it over, at the view that pages open with."""
    heard = []
    camera = SimpleNamespace(
        position=camera_position(9.0), look_at=LOOK_AT, up_direction=(0.0, 0.0, 1.0), aspect=aspect,
        client=SimpleNamespace(atomic=nullcontext), on_update=heard.append,
    )  # fmt: skip
    camera.tell = lambda: asyncio.run(heard[0](camera))
    return camera


def test_the_camera_steps_back_as_the_scene_gets_narrower_and_forward_again():
    camera = some_camera()
    ViserEnvironment(camera)
    distances = []
    for aspect in (2.0, 0.6, 0.3, 2.0):
        camera.aspect = aspect
        camera.tell()
        assert np.allclose(camera.position, camera_position(aspect))
        distances.append(float(np.linalg.norm(camera.position - LOOK_AT)))
    assert distances[0] < distances[1] < distances[2]
    assert distances[3] == distances[0]


def test_a_camera_that_was_moved_stays_until_it_is_brought_back():
    camera = some_camera(aspect=0.6)
    view = ViserEnvironment(camera)
    camera.tell()
    camera.position, camera.look_at, camera.up_direction = np.array((0.4, 0.1, -1.3)), np.zeros(3), (0.0, 1.0, 0.0)
    camera.aspect = 0.5
    camera.tell()
    assert np.array_equal(camera.position, (0.4, 0.1, -1.3))  # Below the floor, and left there.
    view.reset()
    assert np.allclose(camera.position, camera_position(0.5))
    assert np.allclose(camera.look_at, LOOK_AT)
    assert camera.up_direction == (0.0, 0.0, 1.0)
    camera.aspect = 0.4
    camera.tell()
    assert np.allclose(camera.position, camera_position(0.4))  # It follows the window again.
