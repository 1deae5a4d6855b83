"""The page on the first C++ program: its links, and its log as a peer that behaves like the library causes it."""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest

from tests.peers import programs, wire
from tests.peers.arena import arena
from tests.peers.robot import ControlException, Output
from tests.peers.wire import State

DOCS = Path(__file__).parents[1] / "docs"
PAGE = (DOCS / "first-cpp-program.md").read_text(encoding="utf-8")


def swing(amplitude: float, period: float) -> tuple[list[str], bool]:
    """The texts of the controller's log for the program of the page, and whether it threw."""
    with arena() as place:
        with place.connect() as robot:
            robot.set_motor_power(1)
            robot.start_move(wire.JOINT_POSITION, wire.JOINT)
            start: list[float] = []

            def callback(state: State, t: float) -> Output:
                if not start:
                    start.extend(state.q)
                q = [*start]
                q[3] += amplitude / 2 * (1 - math.cos(2 * math.pi * t / period))
                return Output(q=tuple(q), finished=t >= 5.0)

            try:
                robot.control(programs.timed(callback))
                threw = False
            except ControlException:
                threw = True
            robot.receive_fresh_state()
        return [entry.text for entry in place.entries], threw


def printed(kind: str) -> str:
    """The text of the page's log line that contains a phrase."""
    (line,) = [line for line in PAGE.splitlines() if line.startswith("rcilab controller:") and kind in line]
    return re.sub(r"^rcilab controller: \S+ \S+ s ", "", line)


def test_the_program_ends_as_printed() -> None:
    texts, threw = swing(0.1, 2.5)
    assert not threw
    assert {printed("motors on"), printed("motion started")} <= set(texts)
    (ended,) = [text for text in texts if text.startswith("motion ended")]
    pattern = re.escape(printed("motion ended")).replace(r"4\.998", r"[45]\.\d+").replace("4999", r"\d{4}")
    assert re.fullmatch(pattern, ended)


def test_the_program_that_is_too_fast_stops_as_printed() -> None:
    texts, threw = swing(0.2, 0.5)
    assert threw
    assert printed("kCommandJointAccelerationLimitsViolation") in texts


@pytest.mark.parametrize("page", sorted(DOCS.glob("*.md")), ids=lambda page: page.name)
def test_every_link_of_a_page_leads_to_a_file(page: Path) -> None:
    targets = re.findall(r"\]\(([^)#:]+)(?:#[^)]*)?\)", page.read_text(encoding="utf-8"))
    assert [target for target in targets if not (DOCS / target).exists()] == []
