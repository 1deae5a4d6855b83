"""What the last cycles of a motion show of its client."""

from __future__ import annotations

import numpy as np
import pytest

from rcilab.app.text import Text
from rcilab.core.cycle_log import cycle_dtype
from rcilab.i18n.error_messages import describe_note
from rcilab.i18n.translator import Remark
from rcilab.makers.command_findings import find_pause

ANSWERED = [*range(1, 40), *range(72, 80)]  # [ms]


@pytest.mark.parametrize(("unanswered", "found"), [(0, "33"), (30, "")])
def test_a_pause_of_the_client_before_the_end_is_found(unanswered: int, found: str) -> None:
    rows = np.zeros(len(ANSWERED) + 30, cycle_dtype(7))
    rows["sent_ns"][: len(ANSWERED)] = 1_000_000 * np.array(ANSWERED)
    rows["sent_ns"][len(ANSWERED) :] = 1_000_000 * (80 + np.arange(30)) if unanswered else 0
    pause = find_pause(rows)
    assert (f"no command was sent for {found} ms" in pause) == bool(found)
    if found:
        assert isinstance(pause, Remark)
        assert f"{found} ms 未发送指令" in Text("zh").render(describe_note(pause))
