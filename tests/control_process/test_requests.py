"""Requests and their replies over the real shared block; the test plays the control process."""

from __future__ import annotations

import pytest

from rcilab.control_process.layout import MESSAGE_SLOTS, ControlBlock, Counter
from rcilab.control_process.messages import NumberedRequest, Recover, Reply, SetPower, Stop
from rcilab.control_process.requests import MessageRing, RequestClient
from rcilab.core.errors import ConnectionLostError, UsageError


@pytest.fixture
def block():
    block = ControlBlock.create(7, {})
    yield block
    block.close()


def test_each_reply_settles_the_request_it_is_for_and_errors_are_returned(block):
    client = RequestClient(block)
    inbox = MessageRing[NumberedRequest](block.requests, block.counters, Counter.REQUESTS_POSTED, Counter.REQUESTS_READ)
    outbox = MessageRing[Reply](block.replies, block.counters, Counter.REPLIES_POSTED, Counter.REPLIES_READ)
    bodies = [SetPower(True), Recover(), Stop(3)]
    pending = [client.send("a request", body) for body in bodies]
    received = [inbox.pop() for _ in pending]
    assert [request.body for request in received] == bodies
    outbox.post(Reply(received[2].id))
    outbox.post(Reply(received[0].id, UsageError("not now")))
    assert [str(error) for error in client.collect()] == ["not now"]
    assert [request.done for request in pending] == [True, False, True]
    assert pending[2].error is None
    with pytest.raises(UsageError, match="not now"):
        pending[0].wait(0.0)


def test_when_no_reply_will_come_any_more_every_request_fails_with_the_reason(block):
    client = RequestClient(block)
    pending = client.send("power on", SetPower(True))
    client.fail_all(ConnectionLostError("it died"))
    with pytest.raises(ConnectionLostError, match="it died"):
        pending.wait(0.0)
    assert client.collect() == []


def test_a_full_ring_refuses_requests_and_accepts_the_end(block):
    client = RequestClient(block)
    for number in range(MESSAGE_SLOTS):
        client.send("stop", Stop(number))
    with pytest.raises(UsageError, match="requests are queued already"):
        client.send("stop", Stop(99))
    client.send_end()
