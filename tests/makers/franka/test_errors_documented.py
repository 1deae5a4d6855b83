"""The table of errors in the documentation: all 41, and those that tests raise are those that it says are raised."""

from __future__ import annotations

import re
from pathlib import Path

from tests.makers.franka.controller import test_fci_reflexes
from tests.peers.franka import faults
from tests.peers.franka.wire import ERROR_NAMES

DOCUMENT = Path(__file__).parents[3] / "docs" / "franka.md"
OTHERS = ("self_collision_avoidance_violation", "communication_constraints_violation")
"""Raised by tests of their own in `test_fci_reflexes`."""
ROWS = re.findall(r"^\| (\d+) \| (\w+) \| (.+) \|$", DOCUMENT.read_text(encoding="utf-8"), re.MULTILINE)


def raised_by_tests() -> set[int]:
    texts = [case.errors for case in faults.CASES.values()]
    texts += [numbers for numbers, *_ in test_fci_reflexes.CASES.values()]
    words = " ".join(" ".join(text.values()) if isinstance(text, dict) else text for text in texts).split()
    return {int(word) for word in words if word != "..."} | {ERROR_NAMES.index(name) for name in OTHERS}


def test_the_table_has_every_error_at_its_place() -> None:
    assert [(int(number), name) for number, name, _ in ROWS] == list(enumerate(ERROR_NAMES))


def test_an_error_is_raised_in_a_test_unless_the_table_says_why_not() -> None:
    assert {int(number) for number, _, how in ROWS if not how.startswith("not raised: ")} == raised_by_tests()
