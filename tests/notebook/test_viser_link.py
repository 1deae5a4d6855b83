from __future__ import annotations

import math
import socket
import time
import urllib.request
from collections.abc import Iterator
from unittest.mock import MagicMock

import numpy as np
import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

import rcilab
from rcilab.core.errors import UsageError
from rcilab.notebook.viser_link import PreviewPage, serve_preview
from tests.waiting import wait_for

PRO7 = rcilab.load_model("xMatePro7")
MOTION = rcilab.plan_joint(PRO7, PRO7.home, PRO7.home + 0.5)


@pytest.fixture
def page() -> Iterator[PreviewPage]:
    with serve_preview(MOTION, PRO7) as page:
        yield page


def handshake(page: PreviewPage, origin: str | None) -> int:
    """Status of a websocket's opening request."""
    try:
        with connect(page.url.replace("http", "ws"), origin=origin, subprotocols=["viser-v1.1.1"]):  # type: ignore[arg-type]
            return 101
    except InvalidStatus as error:
        return error.response.status_code


def test_the_page_is_served_on_loopback_only(page: PreviewPage) -> None:
    with urllib.request.urlopen(page.url, timeout=5) as answer:
        assert answer.status == 200
    outside = socket.gethostbyname(socket.gethostname())
    for address in {"127.0.0.3", outside} - {"127.0.0.1"}:
        with pytest.raises(OSError, match="refused"):
            socket.create_connection((address, page.port), timeout=2)


@pytest.mark.parametrize("origin", ["http://evil.example", None])
def test_a_foreign_origin_is_refused(page: PreviewPage, origin: str | None) -> None:
    assert handshake(page, origin) == 403


def test_our_own_origin_is_let_in(page: PreviewPage) -> None:
    assert handshake(page, f"http://127.0.0.1:{page.port}") == 101


def test_a_page_is_sent_what_hides_visers_notice_of_software_rendering(monkeypatch: pytest.MonkeyPatch) -> None:
    sent: list[str] = []
    monkeypatch.setattr("rcilab.notebook.viser_link.run_javascript", lambda client, source: sent.append(source))
    with serve_preview(MOTION, PRO7) as page:
        for act in page._guarded_server.viser._client_connect_cb:  # viser calls them once a page has drawn.
            act(MagicMock())
    assert any("#webgl-software-rendering { display: none }" in source for source in sent)


def test_it_plays_by_itself_to_the_end(page: PreviewPage) -> None:
    assert wait_for(lambda: page.time >= MOTION.duration - 1e-3)


def test_a_hand_on_the_slider_holds_the_arm_there(page: PreviewPage) -> None:
    page._slider.value = 0.25
    assert wait_for(lambda: page._play.value is False)
    time.sleep(0.1)
    assert page.time == 0.25
    q1 = MOTION.at(0.25).q[0]
    shown = page._arm._scene._handles[page._arm.joint_nodes[0]].wxyz  # type: ignore[attr-defined]
    np.testing.assert_allclose(shown, [math.cos(q1 / 2), 0.0, 0.0, math.sin(q1 / 2)], atol=1e-12)


def test_a_time_that_is_no_number_is_not_taken(page: PreviewPage) -> None:
    page._slider.value = 0.2
    assert wait_for(lambda: page._play.value is False)
    page._slider.value = math.nan
    assert wait_for(lambda: page.time == 0.2)


def test_a_taken_port_is_refused_with_the_way_round_it(page: PreviewPage) -> None:
    with pytest.raises(UsageError, match=rf"port {page.port} .*port=0 takes a free one"):
        serve_preview(MOTION, PRO7, port=page.port)


def test_closing_frees_the_port() -> None:
    page = serve_preview(MOTION, PRO7)
    page.close()
    page.close()
    with serve_preview(MOTION, PRO7, port=page.port) as again:
        assert again.port == page.port


def test_in_a_notebook_it_is_a_link_and_a_frame(page: PreviewPage) -> None:
    markup = page._repr_html_()
    assert f'<a href="{page.url}"' in markup
    assert f'<iframe src="{page.url}"' in markup


def test_viser_keeps_its_address_box_to_itself(capsys: pytest.CaptureFixture[str]) -> None:
    serve_preview(MOTION, PRO7).close()
    said = capsys.readouterr()
    assert said.out == said.err == ""
