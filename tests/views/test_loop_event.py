"""Messages pushed from a foreign thread wake the event loop, and only from inside it."""

from __future__ import annotations

import asyncio
import threading

from rcilab.views import loop_event


def test_waiters_are_woken_on_the_loop_whatever_thread_sets_the_event():
    woken_in: list[int] = []

    async def main() -> None:
        event = loop_event.LoopEvent(asyncio.get_running_loop())
        waiting = asyncio.ensure_future(event.wait())
        await asyncio.sleep(0)
        (future,) = event._waiters
        future.add_done_callback(lambda _: woken_in.append(threading.get_ident()))
        setter = threading.Thread(target=event.set)
        setter.start()
        setter.join()
        assert not future.done(), "a foreign thread must not touch the waiters"
        await asyncio.wait_for(waiting, 5.0)
        woken_in.append(threading.get_ident())

    asyncio.run(main())
    assert len(set(woken_in)) == 1


def test_setting_it_after_the_loop_has_closed_does_nothing():
    loop = asyncio.new_event_loop()
    event = loop_event.LoopEvent(loop)
    loop.close()
    event.set()
    assert not event.is_set()


def test_every_buffer_of_viser_gets_such_events():
    loop_event.install()
    loop_event.install()
    from viser.infra import _infra

    loop = asyncio.new_event_loop()
    for persistent in (True, False):
        buffer = _infra.AsyncMessageBuffer(loop, persistent_messages=persistent)
        assert isinstance(buffer.message_event, loop_event.LoopEvent)
        assert isinstance(buffer.flush_event, loop_event.LoopEvent)
    loop.close()
