"""100 000 spoilt messages for every way in; those of TCP and UDP are in `test_long_runs`."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.fuzz import wires
from tests.fuzz.files import KINDS, fuzz_file

pytestmark = pytest.mark.endurance
MANY = 100_000


@pytest.mark.parametrize("kind", KINDS)
def test_spoilt_files_are_read_or_refused(kind: str, tmp_path: Path) -> None:
    fuzz_file(kind, MANY, 7, tmp_path)


def test_spoilt_requests_over_the_world_port() -> None:
    wires.fuzz_world(MANY, 7)


def test_spoilt_messages_of_a_page(capfd: pytest.CaptureFixture[str]) -> None:
    wires.fuzz_page(MANY, 7)
    said = capfd.readouterr()
    assert "Traceback" not in said.out + said.err
