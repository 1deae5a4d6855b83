"""A script in the place of a page: what it sends over the raw websocket arrives in order, or not at all."""

from __future__ import annotations

import warnings
from collections import deque
from collections.abc import Iterator
from contextlib import suppress

import msgspec
import pytest
import viser
import zstandard
from websockets.exceptions import ConnectionClosed
from websockets.sync.client import connect

from rcilab.views.access_control import AccessPolicy
from rcilab.views.viser_ext.message_guard import MAX_MESSAGE, MAX_TEXT, MAX_UPLOAD, allow_spectators
from rcilab.views.viser_server import GuardedServer, listen
from tests.waiting import wait_for

NAN, INF = float("nan"), float("inf")


class Page:
    """A server with one control of each kind, and a client that speaks viser's protocol."""

    def __init__(self) -> None:
        bound = listen("127.0.0.1", 0)
        self.port = bound.getsockname()[1]
        self.watching: set[int] = set()  # Clients that may not act.
        self.refused: list[int] = []
        self.guard = GuardedServer(
            bound,
            AccessPolicy(host="127.0.0.1", port=self.port),
            may_act=lambda page: page not in self.watching,
            refuse=self.refused.append,
        )
        server = self.guard.viser
        self.heard: list[object] = []
        gui = server.gui
        self.slider = gui.add_slider("slider", 0.0, 1.0, 0.1, 0.5)
        self.text = gui.add_text("text", "start")
        self.choice = gui.add_dropdown("choice", ("a", "b"))
        self.box = gui.add_checkbox("box", False)
        self.upload = gui.add_upload_button("upload")
        self.gizmo = server.scene.add_transform_controls("/gizmo")
        self.last = gui.add_number("last", 0)
        self.uploads: list[object] = []
        for handle in (self.slider, self.text, self.choice, self.box):
            handle.on_update(self._hear)
        self.gizmo.on_update(self._hear)
        self.upload.on_upload(self._receive)

    async def _hear(self, event) -> None:
        self.heard.append(event)

    async def _receive(self, event) -> None:
        self.uploads.append(event.target.value)

    def open(self):
        return connect(
            f"ws://127.0.0.1:{self.port}/",
            additional_headers={"Origin": f"http://127.0.0.1:{self.port}"},
            subprotocols=[f"viser-v{viser.__version__}"],
            compression=None,
            max_size=None,
        )

    def enter(self, link) -> None:
        """Waits for the server's first words and says where the camera is: from then on a client is connected."""
        link.recv(timeout=20)
        self.send(
            link, "ViewerCameraMessage", wxyz=(1.0, 0.0, 0.0, 0.0), position=(1.0, 0.0, 0.0), fov=1.0, near=0.1,
            far=10.0, image_height=10, image_width=10, look_at=(0.0, 0.0, 0.0), up_direction=(0.0, 0.0, 1.0),
        )  # fmt: skip

    def update(self, link, handle, value: object) -> None:
        self.send(link, "GuiUpdateMessage", uuid=handle._impl.uuid, updates={"value": value})

    def send(self, link, kind: str, **fields: object) -> None:
        link.send(msgspec.msgpack.encode({"type": kind, **fields}))

    def settle(self, link) -> None:
        """Waits until all that was sent before has been dealt with."""
        wanted = self.last.value + 1
        self.update(link, self.last, wanted)
        wait_for(lambda: self.last.value == wanted)


@pytest.fixture(scope="module")
def page() -> Iterator[Page]:
    opened = Page()
    yield opened
    opened.guard.close()


@pytest.fixture
def link(page):
    with page.open() as opened:
        page.enter(opened)
        wait_for(lambda: page.guard.viser.get_clients())
        page.settle(opened)
        page.heard.clear()
        yield opened


def test_what_is_no_value_of_a_control_never_reaches_it(page, link):
    for value in (NAN, INF, -INF, "0.5", [0.5], None, True, {"a": 1}, 2**63):
        page.update(link, page.slider, value)
    for value in (1, None, ["x"], "x" * (MAX_TEXT + 1)):
        page.update(link, page.text, value)
    for value in ("c", 0, None):
        page.update(link, page.choice, value)
    for value in (1, "true", None):
        page.update(link, page.box, value)
    page.send(link, "GuiUpdateMessage", uuid="nobody", updates={"value": 1})
    page.send(link, "GuiUpdateMessage", uuid=page.slider._impl.uuid, updates={"update_cb": []})
    page.send(link, "GuiUpdateMessage", uuid=page.slider._impl.uuid, updates={"value": 0.7, "update_cb": []})
    page.settle(link)
    assert (page.slider.value, page.text.value, page.choice.value, page.box.value) == (0.5, "start", "a", False)
    assert page.heard == []
    assert len(page.slider._impl.update_cb) == 1


def test_a_number_out_of_range_is_moved_into_it(page, link):
    page.update(link, page.slider, 77)
    page.settle(link)
    assert page.slider.value == 1.0
    page.update(link, page.slider, 0.5)
    page.settle(link)
    assert page.slider.value == 0.5


def test_handles_in_the_scene_are_never_dragged_to_nowhere(page, link):
    for position in ((NAN, 0.0, 0.0), (INF, 0.0, 0.0)):
        page.send(
            link,
            "TransformControlsUpdateMessage",
            name="/gizmo",
            wxyz=(1.0, 0.0, 0.0, 0.0),
            position=position,
            owner="",
        )
    page.settle(link)
    assert page.heard == []
    assert tuple(page.gizmo.position) == (0.0, 0.0, 0.0)


def start_upload(page, link, name: str, size: int, parts: int) -> None:
    page.send(
        link, "FileTransferStartUpload", source_component_uuid=page.upload._impl.uuid, transfer_uuid=name,
        filename="program.json", mime_type="application/json", part_count=parts, size_bytes=size,
    )  # fmt: skip


def send_part(page, link, name: str, index: int, content: bytes) -> None:
    page.send(
        link, "FileTransferPart", source_component_uuid=page.upload._impl.uuid, transfer_uuid=name, part_index=index,
        content=content,
    )  # fmt: skip


def test_an_upload_is_bounded_before_it_is_kept(page, link):
    states = page.guard.viser.gui._current_file_upload_states
    start_upload(page, link, "huge", MAX_UPLOAD + 1, 4)
    send_part(page, link, "huge", 0, b"x" * 1000)
    start_upload(page, link, "split", 1000, 10**6)
    send_part(page, link, "never announced", 0, b"x" * 1000)
    start_upload(page, link, "more than said", 1000, 3)
    send_part(page, link, "more than said", 0, b"x" * 600)
    send_part(page, link, "more than said", 1, b"x" * 600)
    page.settle(link)
    assert set(states) == {"more than said"}
    assert states["more than said"]["transferred_bytes"] == 600
    start_upload(page, link, "good", 7, 2)
    send_part(page, link, "good", 0, b"half")
    send_part(page, link, "good", 1, b"end")
    wait_for(lambda: [file.content for file in page.uploads] == [b"halfend"])
    start_upload(page, link, "second", 10, 1)
    start_upload(page, link, "third", 10, 1)
    page.settle(link)
    assert set(states) == {"more than said", "second"}


def test_only_the_page_that_uploads_is_told_of_its_upload(page, link):
    with page.open() as other:
        page.enter(other)
        start_upload(page, link, "own", 3, 1)
        send_part(page, link, "own", 0, b"all")
        page.settle(link)
        with page.open() as later:
            page.enter(later)
            page.settle(later)
            of_all = [{message["type"] for message in received(each)} for each in (link, other, later)]
    assert ["FileTransferPartAck" in kinds for kinds in of_all] == [True, False, False]


def test_a_page_that_goes_leaves_no_upload_behind(page):
    states = page.guard.viser.gui._current_file_upload_states
    with page.open() as link:
        link.recv(timeout=20)
        page.settle(link)
        start_upload(page, link, "left", 100, 2)
        page.settle(link)
    wait_for(lambda: not states)
    with page.open() as link:
        link.recv(timeout=20)
        page.settle(link)
        start_upload(page, link, "left", 100, 2)
        page.settle(link)
        assert set(states) == {"left"}


def test_a_message_without_an_end_costs_its_sender_the_connection(page):
    with page.open() as link:
        with suppress(ConnectionClosed):
            link.send(b"x" * (MAX_MESSAGE + 1))
        with pytest.raises(ConnectionClosed):
            deque((link.recv(timeout=20) for _ in range(10_000)), maxlen=0)


def client_of(page) -> int:
    """The newest client."""
    wait_for(lambda: page.guard.viser.get_clients())
    return max(page.guard.viser.get_clients())


def received(link) -> list[dict]:
    """What the server has sent this page until now."""
    messages: list[dict] = []
    with suppress(TimeoutError):
        while True:
            raw = link.recv(timeout=0.3)
            packed = raw[16 : 16 + int.from_bytes(raw[8:16], "little")]
            unpacked = zstandard.ZstdDecompressor().decompress(packed, max_output_size=10**8)
            messages += msgspec.msgpack.decode(unpacked)["messages"]
    return messages


def values_sent(link, handle) -> list[object]:
    """What the server has told this page about a control until now."""
    return [
        message["updates"]["value"]
        for message in received(link)
        if message.get("uuid") == handle._impl.uuid and message["type"] == "GuiUpdateMessage"
    ]


def test_a_page_that_watches_changes_nothing_and_is_shown_what_all_see(page, link):
    with page.open() as other:
        page.enter(other)
        page.settle(other)
        watcher = client_of(page)
        page.watching.add(watcher)
        page.refused.clear()
        values_sent(other, page.text)
        page.update(other, page.text, "rci://192.0.2.1")
        page.update(other, page.slider, 0.9)
        page.send(
            other, "TransformControlsUpdateMessage", name="/gizmo", wxyz=(1.0, 0.0, 0.0, 0.0),
            position=(1.0, 0.0, 0.0), owner="",
        )  # fmt: skip
        start_upload(page, other, "watched", 4, 1)
        send_part(page, other, "watched", 0, b"evil")
        assert values_sent(other, page.text) == ["start"], "its own box goes back to what all see"
        page.settle(link)
        assert (page.text.value, page.slider.value, tuple(page.gizmo.position)) == ("start", 0.5, (0.0, 0.0, 0.0))
        assert page.heard == []
        assert set(page.refused) == {watcher}
        allow_spectators(page.box)
        page.update(other, page.box, True)
        wait_for(lambda: page.box.value)
        page.box.value = False
        page.watching.clear()
        page.update(other, page.slider, 0.9)
        wait_for(lambda: page.slider.value == 0.9)
        page.slider.value = 0.5


@pytest.mark.parametrize(
    "message",
    [
        {"type": "GuiUpdateMessage", "uuid": [], "updates": {"value": 1}},
        {"type": "GuiUpdateMessage", "uuid": "x", "updates": []},
        {"type": "GuiUpdateMessage"},
        {"type": "GuiButtonHoldMessage", "uuid": {}, "frequency": 10.0},
        {"type": "CommandTriggerMessage", "uuid": []},
        {"type": "FileTransferPart", "source_component_uuid": [], "transfer_uuid": [], "part_index": 0, "content": "x"},
        {"type": "ViewerCameraMessage", "wxyz": 1},
        {"type": "ViewerCameraMessage", "wxyz": ["x"] * 4, "position": [0.0] * 3, "fov": 1.0, "near": 0.1, "far": 1.0,
         "image_height": 1, "image_width": 1, "look_at": [0.0], "up_direction": [0.0] * 3},
        {"type": "SceneNodeClickMessage", "name": [], "instance_index": None, "ray_origin": [0.0] * 3,
         "ray_direction": [0.0] * 3, "screen_pos": [0.0] * 2, "modifier": "none", "owner": ""},
        {"type": "nothing"},
        {},
        [],
        "text",
        None,
    ],
)  # fmt: skip
def test_what_is_no_message_is_dropped_counted_and_said_once(page, link, message, capfd):
    before = page.guard.guard.malformed
    for _ in range(3):
        link.send(msgspec.msgpack.encode(message))
    link.send(b"\xc1 no msgpack")
    link.send("words")
    page.settle(link)  # The page is still there.
    assert page.guard.guard.malformed == before + 5
    said = capfd.readouterr()
    first = "a page has sent a malformed message; such messages are dropped\n"
    assert said.out + said.err == ("" if before else first)


@pytest.mark.parametrize("position", ["x" * 300, [1] * 3000], ids=["a text", "too many numbers"])
def test_a_field_that_viser_would_warn_of_is_dropped_and_not_quoted(capfd, position):
    """Outside a test a warning is printed with the whole value, once for each value, and each one is kept in memory."""
    camera = {
        "type": "ViewerCameraMessage", "wxyz": [1.0, 0.0, 0.0, 0.0], "position": position, "fov": 1.0, "near": 0.1,
        "far": 9.0, "image_height": 9, "image_width": 9, "look_at": [0.0] * 3, "up_direction": [0.0, 0.0, 1.0],
    }  # fmt: skip
    with warnings.catch_warnings(record=True) as quoted:
        warnings.resetwarnings()  # As a program of a user has them.
        page = Page()
        try:
            with page.open() as link:
                link.send(msgspec.msgpack.encode(camera))
                page.settle(link)
            assert page.guard.guard.malformed == 1
        finally:
            page.guard.close()
    assert quoted == []
    said = capfd.readouterr()
    assert said.out + said.err == "a page has sent a malformed message; such messages are dropped\n"
