"""The tools of the scene's toolbar: measuring between picked points, a picture and a film of the scene."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import pytest

from browser.page import BenchPage
from rcilab.app.cell.cell_actions import EditCell, MoveEntry, SelectEntry
from rcilab.app.view_actions import Play, SetView


def pick(page: BenchPage, point: tuple[float, float, float]) -> None:
    """Clicks where the camera sees a point, base axes, [m]."""
    page.tab.mouse.click(*page.project("/base_axes", point))


@pytest.fixture
def boxed(page: BenchPage):
    """A box beside the arm."""
    ask = page.bench.dispatcher.ask
    ask(EditCell(what="add", name="box"))
    page.wait(lambda: page.state.cell.cell is not None and page.is_drawn("/cell/obstacle0/mesh"), "the box")
    ask(MoveEntry(index=0, position=(0.3, -0.4, 0.1), wxyz=(1.0, 0.0, 0.0, 0.0), ended=True))
    ask(SelectEntry(index=-1))
    page.wait(lambda: not page.is_drawn("/cell_handles"), "no handles")
    yield page.state.cell.cell.obstacles[0]
    ask(EditCell(what="clear"))
    page.wait(lambda: page.state.cell.cell is None, "an empty cell")


def test_two_picks_measure_distance_steps_and_angle_and_the_points_follow_what_moves(page: BenchPage, boxed):
    card = page.tab.locator("#rl-measured")
    button = page.tab.locator("#rl-toolbar").get_by_role("button", name="Measure")
    button.click()
    page.wait(lambda: "first point" in card.inner_text(), "the request for a point")
    top = boxed.pose.position + (0.0, 0.0, 0.5 * boxed.shape.size[2])
    before = page.state.goal.target
    pick(page, (0.6, -0.3, 0.0))
    page.wait(lambda: "second point" in card.inner_text(), "the request for another point")
    pick(page, tuple(top))
    page.wait(lambda: "dz" in card.inner_text(), "the result")
    numbers = dict(zip(("dx", "dy", "dz"), _numbers(card.inner_text()), strict=True))
    assert numbers["dz"] == pytest.approx(1000.0 * top[2], abs=0.11), "from the floor to the upper side"
    assert numbers["dx"] == pytest.approx(1000.0 * (top[0] - 0.6), abs=15.0), "a pixel is some millimetres"
    assert numbers["dy"] == pytest.approx(1000.0 * (top[1] + 0.3), abs=15.0)
    distance = float(card.inner_text().split(" mm")[0])
    assert distance == pytest.approx(float(np.linalg.norm(list(numbers.values()))), abs=0.2)
    assert "Angle between the faces: 0.0°" in card.inner_text()
    assert f"Floor → {boxed.name}" in card.inner_text()
    assert page.state.goal.target.is_close(before, 0.0)
    ask = page.bench.dispatcher.ask
    ask(MoveEntry(index=0, position=(0.3, -0.4, 0.2), wxyz=(1.0, 0.0, 0.0, 0.0), ended=True))
    higher = numbers["dz"] + 100.0
    page.wait(lambda: abs(_numbers(card.inner_text())[2] - higher) < 0.11, "the point to follow the box")
    button.click()
    page.wait(lambda: card.count() == 0, "the end of measuring")
    assert page.tab.locator("#rl-measure").count() == 0


def test_a_tap_of_a_finger_chooses_an_obstacle(page: BenchPage, boxed):
    session = page.tab.context.new_cdp_session(page.tab)
    x, y = page.project("/base_axes", tuple(boxed.pose.position))
    session.send("Input.dispatchTouchEvent", {"type": "touchStart", "touchPoints": [{"x": x, "y": y}]})
    session.send("Input.dispatchTouchEvent", {"type": "touchEnd", "touchPoints": []})
    page.wait(lambda: page.state.cell.selected is not None, "the chosen box")


def _numbers(text: str) -> list[float]:
    steps = next(line for line in text.splitlines() if line.startswith("dx"))
    return [float(number) for number in steps.split()[1::2]]


def test_a_picture_has_the_size_of_the_scene_and_what_is_measured_in_it(page: BenchPage, tmp_path: Path):
    size = page.tab.evaluate("[rcilabScene.canvas().width, rcilabScene.canvas().height]")
    with page.tab.expect_download() as download:
        page.tab.locator("#rl-toolbar").get_by_role("button", name="Picture").click()
    assert download.value.suggested_filename.startswith("rcilab-")
    content = _saved(download.value, tmp_path)
    assert content.startswith(b"\x89PNG")
    assert list(struct.unpack(">II", content[16:24])) == size


def test_a_film_plays_the_preview_once_and_can_be_cancelled(page: BenchPage, tmp_path: Path):
    film = page.tab.locator("#rl-toolbar").get_by_role("button", name="Film")
    page.wait(film.is_disabled, "nothing to play")
    page.plan_to(1, 15.0)
    page.wait(film.is_enabled, "a plan to film")
    page.bench.dispatcher.ask(SetView(name="rate", value=0.1))
    page.wait(lambda: page.state.rate == 0.1, "a slow preview")
    film.click()
    page.tab.locator("#rl-film").get_by_role("button", name="Cancel").click()
    page.wait(lambda: not page.state.playing and page.tab.locator("#rl-film").count() == 0, "the end of the film")
    page.bench.dispatcher.ask(SetView(name="rate", value=1.0))
    with page.tab.expect_download() as download:
        film.click()
        page.wait(lambda: page.state.playing or page.state.playhead >= 1.0, "the preview to play")
    assert page.state.playhead == 1.0
    assert download.value.suggested_filename.endswith(".webm")
    content = _saved(download.value, tmp_path)
    assert content.startswith(b"\x1a\x45\xdf\xa3")
    assert b"webm" in content[:64]
    page.bench.dispatcher.ask(Play(playing=False))


def _saved(download, folder: Path) -> bytes:
    download.save_as(folder / "file")
    return (folder / "file").read_bytes()
