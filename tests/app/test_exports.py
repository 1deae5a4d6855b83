"""One export at a time: the next one may begin as soon as the page shows that the last one is over."""

from __future__ import annotations

from typing import Any

from rcilab.app.goal.goal import goal_at
from rcilab.app.run.export_actions import ExportActions, ExportRun
from rcilab.app.run.run_recorder import whole_recording
from rcilab.app.store import Store, UiState
from tests.recording.runs import MODEL, some_run
from tests.waiting import wait_for


def test_another_export_is_refused_until_the_last_one_is_over_and_not_a_moment_longer():
    sent: list[str] = []

    class Watched(Store):
        """Asks for the next export at the very end of the first one, while its thread is still there."""

        def update(self, **changes: Any) -> UiState:
            state = super().update(**changes)
            if changes == {"export": None} and len(sent) == 1:
                actions.export(ExportRun(ending=".rcirun"))
            return state

    def deliver(page, name, stream, is_cancelled) -> bool:
        if not sent:
            actions.export(ExportRun(ending=".html"))
        sent.append(name)
        return True

    run = whole_recording(some_run())
    store = Watched(UiState(model=MODEL, goal=goal_at(MODEL, MODEL.home), last_run=run))
    actions = ExportActions(store, deliver)
    actions.export(ExportRun(ending=".csv"))
    wait_for(lambda: len(sent) == 2 and store.state.export is None, what="two exports")
    assert [name.rpartition(".")[2] for name in sent] == ["csv", "rcirun"]
    assert [notice.text.code for notice in store.state.notices] == ["export.busy", "export.done", "export.done"]
