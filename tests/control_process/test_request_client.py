"""Requests and their tickets over the real shared block; the test plays the control process."""

from __future__ import annotations

import pytest

from rcilab.control_process.error_codec import pack_failure
from rcilab.control_process.layout import MAIL_SLOTS, ControlBlock, Counter
from rcilab.control_process.message_ring import MessageRing
from rcilab.control_process.request_client import RequestClient
from rcilab.core.errors import ConnectionLostError, UsageError


@pytest.fixture
def block():
    block = ControlBlock.create(7, {})
    yield block
    block.close()


def test_each_reply_settles_the_ticket_it_is_for_and_failures_are_returned(block):
    desk = RequestClient(block)
    inbox = MessageRing(block.requests, block.words, Counter.REQUESTS_POSTED, Counter.REQUESTS_TAKEN)
    outbox = MessageRing(block.replies, block.words, Counter.REPLIES_POSTED, Counter.REPLIES_TAKEN)
    tickets = [desk.send(what, {"kind": what}) for what in ("first", "second", "third")]
    letters = [inbox.take() for _ in tickets]
    assert [letter["kind"] for letter in letters] == ["first", "second", "third"]
    outbox.post({"id": letters[2]["id"]})
    outbox.post({"id": letters[0]["id"], "failure": pack_failure(UsageError("not now"))})
    assert [failure["message"] for failure in desk.collect()] == ["not now"]
    assert [ticket.done for ticket in tickets] == [True, False, True]
    assert tickets[2].error is None
    with pytest.raises(UsageError, match="not now"):
        tickets[0].wait(0.0)


def test_when_nobody_will_answer_any_more_every_ticket_fails_with_the_reason(block):
    desk = RequestClient(block)
    ticket = desk.send("power on", {"kind": "power"})
    desk.fail_all(ConnectionLostError("it died"))
    with pytest.raises(ConnectionLostError, match="it died"):
        ticket.wait(0.0)
    assert desk.collect() == []


def test_a_full_mailbox_refuses_requests_and_lets_the_end_go_its_way(block):
    desk = RequestClient(block)
    for _ in range(MAIL_SLOTS):
        desk.send("stop", {"kind": "stop"})
    with pytest.raises(UsageError, match="requests are waiting already"):
        desk.send("stop", {"kind": "stop"})
    desk.send_end()
