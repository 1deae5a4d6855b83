"""Links to a view: exact, short, and harmless whatever their text is."""

from __future__ import annotations

import base64
import json
import zlib

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rcilab.app.link.page_link import LONGEST_LINK, PageLink, decode_link, encode_link
from rcilab.cell.cell import Cell
from rcilab.cell.entries import Obstacle
from rcilab.cell.shapes import MeshShape
from rcilab.core.errors import InvalidValueError, RcilabError, VersionMismatchError
from rcilab.model.robot_model import load_model
from rcilab.motion import Program, Waypoint

MODEL = load_model("xMatePro7")
PROGRAM = Program(
    model=MODEL.name,
    start=MODEL.home,
    name="test, 测试",
    waypoints=tuple(Waypoint.joint(MODEL.home + 0.01 * number, blend=0.01) for number in range(30)),
)
CELL = Cell.example("pick_place")


def packed(content: object) -> str:
    return base64.urlsafe_b64encode(zlib.compress(json.dumps(content).encode())).decode()


@pytest.mark.parametrize("program", [None, PROGRAM])
@pytest.mark.parametrize("cell", [None, CELL])
def test_a_link_opens_what_it_was_made_of_and_fits_an_address(program, cell):
    text = encode_link(PageLink(model=MODEL.name, program=program, cell=cell))
    assert len(text) < LONGEST_LINK
    assert set(text) <= set("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789-_")
    found = decode_link(text)
    assert (found.model, found.program) == (MODEL.name, program)
    assert (found.cell and found.cell.fingerprint) == (cell and cell.fingerprint)


@given(st.text(max_size=200))
def test_any_other_text_is_refused(text):
    with pytest.raises(InvalidValueError, match="damaged"):
        decode_link(text)


def test_a_cut_link_one_of_another_version_and_one_that_unpacks_to_gigabytes_are_refused():
    text = encode_link(PageLink(model=MODEL.name, program=PROGRAM))
    for damaged in (
        text[:-40],
        text[:50] + text[60:],
        packed([1]),
        packed({"version": 1}),
        packed({"version": 1, "model": "R2"}),
    ):
        with pytest.raises(InvalidValueError, match="damaged"):
            decode_link(damaged)
    with pytest.raises(VersionMismatchError):
        decode_link(packed({"version": 2, "model": MODEL.name}))
    bomb = base64.urlsafe_b64encode(zlib.compress(b" " * 50_000_000, 9)).decode()
    with pytest.raises(InvalidValueError, match="damaged"):
        decode_link(bomb)
    for wrong in ({"program": {"format": "x"}}, {"cell": 3}, {"other": 1}, {"cell": {"format": "rcilab cell"}}):
        with pytest.raises(RcilabError):
            decode_link(packed({"version": 1, "model": MODEL.name, **wrong}))
    with pytest.raises(InvalidValueError, match="damaged"):
        decode_link(packed({"version": 1, "model": "xMate3", "program": json.loads(PROGRAM.to_json())}))


def test_a_cell_with_a_mesh_is_too_large_for_a_link():
    mesh = MeshShape(vertices=np.eye(3), faces=np.array([[0, 1, 2]]))
    cell = Cell(model=MODEL.name, obstacles=(Obstacle(name="part", shape=mesh),))
    with pytest.raises(InvalidValueError, match="too large for a link"):
        encode_link(PageLink(model=MODEL.name, cell=cell))
