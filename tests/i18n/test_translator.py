"""Sentences that are put together."""

from __future__ import annotations

import pytest

from rcilab.app.text import Text
from rcilab.i18n.translator import with_space


@pytest.mark.parametrize(("language", "gap"), [("en", " "), ("zh", "")])
@pytest.mark.parametrize("tone", ["good", "warn", "bad"])
def test_chinese_has_no_space_between_a_lead_and_what_follows(language: str, gap: str, tone: str) -> None:
    lead = Text(language)(f"reach.tone.{tone}")
    assert with_space(lead, "6") == (lead, f"{gap}6")
