"""Messages pushed from a foreign thread wake the event loop, and only from inside it, and only when it waits."""

from __future__ import annotations

import asyncio
import threading

import pytest

from rcilab.views.viser_ext import loop_event


class CountingLoop(asyncio.SelectorEventLoop):
    """Counts how often other threads wake it."""

    wakes = 0

    def call_soon_threadsafe(self, *args, **options):
        self.wakes += 1
        return super().call_soon_threadsafe(*args, **options)


@pytest.fixture
def loop():
    loop = CountingLoop()
    yield loop
    loop.close()


def in_thread(act):
    thread = threading.Thread(target=act)
    thread.start()
    thread.join()


def test_waiters_are_woken_on_the_loop_whatever_thread_sets_the_event(loop):
    woken_in: list[int] = []

    async def main() -> None:
        event = loop_event.LoopEvent(loop)
        waiting = [asyncio.ensure_future(event.wait()) for _ in range(2)]
        await asyncio.sleep(0)
        for future in event._waiting:
            future.add_done_callback(lambda _: woken_in.append(threading.get_ident()))
        in_thread(event.set)
        assert not any(future.done() for future in event._waiting), "a foreign thread must not touch the waiters"
        assert await asyncio.wait_for(asyncio.gather(*waiting), 5.0) == [True, True]
        assert event.is_set()
        assert await event.wait()
        event.clear()
        cancelled = asyncio.ensure_future(event.wait())
        await asyncio.sleep(0)
        cancelled.cancel()
        await asyncio.sleep(0)
        assert event._waiting == []
        event.set()
        assert await event.wait()

    loop.run_until_complete(main())
    assert woken_in == [threading.get_ident()] * 2


def test_setting_it_after_the_loop_has_closed_does_nothing():
    loop = asyncio.new_event_loop()
    event = loop_event.LoopEvent(loop)
    loop.close()
    event.set()


def test_nobody_is_woken_while_nobody_waits_and_nothing_set_meanwhile_is_lost(loop):
    async def main() -> None:
        event = loop_event.LoopEvent(loop)
        for _ in range(50):
            in_thread(event.set)
        assert loop.wakes == 0
        await asyncio.wait_for(event.wait(), 5.0)

        said: list[int] = []

        def say() -> None:
            for k in range(3000):
                said.append(k)
                event.set()

        thread, heard = threading.Thread(target=say), 0
        thread.start()
        while heard < 3000:
            await asyncio.wait_for(event.wait(), 5.0)
            event.clear()
            heard = len(said)
        thread.join()

    loop.run_until_complete(main())


def test_every_buffer_of_viser_wakes_its_loop_once_a_batch(loop):
    loop_event.install()
    loop_event.install()
    from viser._messages import SetOrientationMessage
    from viser.infra import _infra

    async def main() -> None:
        for persistent in (True, False):
            buffer = _infra.AsyncMessageBuffer(loop, persistent_messages=persistent)
            assert isinstance(buffer.flush_event, loop_event.LoopEvent)
            waiting = asyncio.ensure_future(buffer.message_event.wait())
            await asyncio.sleep(0)
            before = loop.wakes
            buffer.atomic_start()
            in_thread(lambda b=buffer: [b.push(SetOrientationMessage(f"/{k}", (1.0, 0.0, 0.0, 0.0))) for k in range(7)])
            assert loop.wakes == before
            in_thread(buffer.atomic_end)
            assert loop.wakes == before + 1
            await asyncio.wait_for(waiting, 5.0)
            buffer.message_event.clear()
            in_thread(lambda b=buffer: b.push(SetOrientationMessage("/alone", (1.0, 0.0, 0.0, 0.0))))
            assert buffer.message_event.is_set()

    loop.run_until_complete(main())
