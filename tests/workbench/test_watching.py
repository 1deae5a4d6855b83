"""A script in the place of a watching page, over the raw websocket: nothing that it sends is seen or acted on."""

from __future__ import annotations

import json
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import msgspec
import pytest
import viser
from websockets.sync.client import ClientConnection, connect

from rcilab.app.control_lock_actions import Refuse
from rcilab.app.program.edit_actions import EditProgram
from rcilab.app.request import Request
from rcilab.app.run.target_robot_actions import ChooseDestination
from rcilab.app.view_actions import CommitField
from rcilab.workbench.app import Workbench
from tests.workbench.opened import opened, told, wait


@pytest.fixture(scope="module")
def bench() -> Iterator[Workbench]:
    with opened() as bench:
        yield bench


class Script:
    """Speaks viser's protocol and that of the bar."""

    def __init__(self, bench: Workbench, link: ClientConnection, bar: ClientConnection) -> None:
        self._bench, self._link, self._bar = bench, link, bar
        before = set(bench.server.get_clients())
        link.recv(timeout=20)
        self._send(
            "ViewerCameraMessage", wxyz=(1.0, 0.0, 0.0, 0.0), position=(1.0, 0.0, 0.0), fov=1.0, near=0.1,
            far=10.0, image_height=10, image_width=10, look_at=(0.0, 0.0, 0.0), up_direction=(0.0, 0.0, 1.0),
        )  # fmt: skip
        wait(lambda: set(bench.server.get_clients()) != before, "the page to be there")
        (self.page,) = set(bench.server.get_clients()) - before
        wait(lambda: self.page in bench.store.state.control_lock.pages, "the page to be listed")
        self.say("hello", page=self.page, key=bench.live.introduce(self.page))

    def set(self, handle: Any, value: object) -> None:
        self._send("GuiUpdateMessage", uuid=handle._impl.uuid, updates={"value": value})

    def say(self, kind: str, **values: object) -> None:
        self._bar.send(json.dumps({"kind": kind, **values}))

    def settle(self) -> None:
        """Waits until all that it has sent is dealt with: of a page's words only "entered" leaves a trace."""
        before = self._bench.store.state.entered.get(self.page)
        self.say("entered")
        wait(lambda: self._bench.store.state.entered.get(self.page) != before, "an answer")

    def _send(self, kind: str, **fields: object) -> None:
        self._link.send(msgspec.msgpack.encode({"type": kind, **fields}))


@contextmanager
def script(bench: Workbench) -> Iterator[Script]:
    origin = {"Origin": f"http://127.0.0.1:{bench.port}"}
    protocol: Any = f"viser-v{viser.__version__}"
    address = f"ws://127.0.0.1:{bench.port}"
    with (
        connect(
            f"{address}/", additional_headers=origin, subprotocols=[protocol], max_size=None, ping_interval=None
        ) as link,
        connect(f"{address}/rcilab/live", additional_headers=origin, ping_interval=None) as bar,
    ):
        yield Script(bench, link, bar)


def controls(bench: Workbench) -> dict[str, Any]:
    """Every control of the page, by its label and number."""
    inputs = bench.server.gui._gui_input_handle_from_uuid.values()
    return {f"{getattr(handle, 'label', '')} {number}": handle for number, handle in enumerate(inputs)}


def poke(value: object, handle: Any) -> object:
    """Another value that the control could have."""
    if isinstance(value, bool):
        return not value
    if isinstance(value, int | float):
        highest = getattr(handle, "max", 100.0)
        return highest if value != highest else handle.min
    options = getattr(handle, "options", None)
    if options:
        return next((option for option in options if option != value), value)
    return "rci://192.0.2.1:1337" if isinstance(value, str) else value


def knows_simulation(bench: Workbench) -> bool:
    world = bench.store.state.world
    return world.status is not None and world.status.auto_limit in (None, world.auto_limit)


def test_no_control_of_a_watching_page_leads_anywhere(bench):
    with script(bench) as operator, script(bench) as watcher:
        assert bench.store.state.control_lock.holder == operator.page
        wait(lambda: knows_simulation(bench), "the state of the simulation")
        before = bench.store.state
        shown = {name: handle.value for name, handle in controls(bench).items() if not handle._impl.is_button}
        for name, handle in controls(bench).items():
            if "controls" not in name:
                watcher.set(handle, True if handle._impl.is_button else poke(handle.value, handle))
        for kind, values in (("seek", {"share": 0.7}), ("size", {"height": 333.0}), ("peek", {"branch": 1})):
            watcher.say(kind, **values)
        watcher.settle()
        wait(lambda: told(bench) == "notice.watching", "the watching page to be told")
        after = bench.store.state
        ours = [
            name for name in before.__dataclass_fields__ if name not in ("notices", "entered", "control_lock", "world")
        ]
        assert [name for name in ours if getattr(after, name) is not getattr(before, name)] == []
        assert {**vars(after.world), "status": None} == {
            **vars(before.world),
            "status": None,
        }  # The simulation reports on.
        assert {name: handle.value for name, handle in controls(bench).items() if name in shown} == shown
        assert bench.session.status().phase == "idle"


def test_no_row_of_a_watching_page_leads_anywhere(bench):
    with script(bench) as operator, script(bench) as watcher:
        bench.dispatcher.ask(EditProgram(page=operator.page, what="add"))
        wait(lambda: bool(bench.store.state.program.draft.steps), "a waypoint")
        acted: list[Request] = []

        def recorded(act: Any) -> Any:
            return lambda request: (acted.append(request), act(request))

        before = bench.store.state
        key = before.program.draft.steps[0].key
        rows: list[tuple[str, dict[str, Any]]] = [
            ("condition", {"id": "joint.velocity"}), ("branch", {"index": 1}),
            *(("edit", {"what": what, "key": key, "index": 0}) for what in ("delete", "duplicate", "undo", "select")),
        ]  # fmt: skip
        with pytest.MonkeyPatch.context() as patch:
            handlers = {kind: recorded(act) for kind, act in bench.dispatcher._handlers.items()}
            patch.setattr(bench.dispatcher, "_handlers", handlers)
            for kind, values in rows:
                watcher.say(kind, **values)
            watcher.settle()
            after = bench.store.state
            assert (after.program, after.goal, after.check) == (before.program, before.goal, before.check)
            operator.say("edit", what="delete", key=key, index=0)
            wait(lambda: not bench.store.state.program.draft.steps, "the operator's message to be acted on")
        assert {type(request) for request in acted if request.page == watcher.page} <= {Refuse, CommitField}


def test_what_a_page_typed_goes_with_its_controls(bench):
    with script(bench) as first, script(bench) as second:
        bench.dispatcher.ask(ChooseDestination(page=first.page, where="address", address="rci://192.0.2.7:1337"))
        wait(lambda: bench.store.state.typed_address != "", "the question")
        address = next(handle for name, handle in controls(bench).items() if name.startswith("Address"))
        name = next(handle for label, handle in controls(bench).items() if label.startswith("Name"))
        first.set(address, "rci://192.0.2.7:1337")
        first.set(name, "mine")
        wait(lambda: (address.value, name.value) == ("rci://192.0.2.7:1337", "mine"), "what was typed")
        second.say("take")
        first.say("answer", yes=True)
        wait(lambda: bench.store.state.control_lock.holder == second.page, "the controls to pass")
        wait(lambda: (address.value, name.value) == ("", ""), "the words of the other page to go")
        wait(lambda: bench.store.state.typed_address == "", "the question to go")
