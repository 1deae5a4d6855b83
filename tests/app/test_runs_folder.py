"""Recorded runs are cleared away only when that was asked for twice, and by whom it concerns."""

from __future__ import annotations

from rcilab.app.goal.goal import goal_at
from rcilab.app.run.folder_actions import ClearRuns, FolderActions, megabytes
from rcilab.app.store import Store, UiState
from rcilab.model.robot_model import load_model

MODEL = load_model("xMatePro7")


def test_runs_are_deleted_after_a_second_yes_for_as_many_as_were_asked_about(tmp_path):
    for number in range(8):
        (tmp_path / f"{number}.rcirun").write_bytes(b"x" * 1000)
    store = Store(UiState(model=MODEL, goal=goal_at(MODEL, MODEL.home), runs=tmp_path))
    actions = FolderActions(store)

    def clear(what, keep=5) -> int:
        actions.clear(ClearRuns(what=what, keep=keep))
        return len(list(tmp_path.iterdir()))

    actions.tick()
    assert (store.state.folder.count, store.state.folder.size) == (8, 8000)
    assert clear("confirm") == 8
    assert clear("choose") == 8
    assert clear("ask") == 8
    assert store.state.folder.asked
    assert clear("confirm", keep=0) == 8
    assert clear("cancel") == 8
    assert clear("confirm") == 8
    assert clear("ask") == 8
    assert clear("confirm") == 5
    assert store.state.notice.text.values["count"] == 3
    actions.tick()
    assert store.state.folder.count == 5
    assert clear("choose", keep=3) == 5  # None of the offers.
    assert store.state.folder.keep == 5


def test_sizes_are_said_in_units_of_disks():
    assert megabytes(1_500_000) == "1.5 MB"
    assert megabytes(2_340_000_000) == "2.34 GB"
