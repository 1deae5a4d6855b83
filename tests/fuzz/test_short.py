"""A short look at what spoilt input does; the long one is in tests/endurance."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.fuzz import wires
from tests.fuzz.files import KINDS, fuzz_file


@pytest.mark.parametrize("kind", KINDS)
def test_a_spoilt_file_is_read_or_refused(kind: str, tmp_path: Path) -> None:
    fuzz_file(kind, 1500, 1, tmp_path)


def test_a_spoilt_request_over_the_world_port_is_answered_or_ends_its_connection() -> None:
    wires.fuzz_world(2000, 1)


def test_spoilt_messages_of_a_page_change_nothing_but_what_they_may(capfd: pytest.CaptureFixture[str]) -> None:
    wires.fuzz_page(3000, 1)
    said = capfd.readouterr()
    assert "Traceback" not in said.out + said.err
