"""A push that lasts while it is held: whoever pushes says so again and again, and silence ends it.

    with HeldPush(World(host, port)) as push:
        while the_button_is_down():
            push.hold([0, 20, 0, 0, 0, 0], link=4)
            time.sleep(0.1)

Nobody who calls waits for the world port; a thread does. The virtual controller hears of pushes with a duration only:
even if this process dies with a push in its hand, the push ends.
"""

from __future__ import annotations

import threading
import time
from dataclasses import dataclass

from numpy.typing import ArrayLike

from rcilab.core.arrays import as_vector
from rcilab.core.closeable import Closeable
from rcilab.core.errors import RcilabError
from rcilab.execution.simulation_control import SimulationControl

HOLD_TIMEOUT = 0.4  # [s] without `hold` after which a push ends; a choice, as a page says it ten times a second.
_LENGTH = 0.5  # [s] of each push that the controller hears of, in its own time; a choice above the next number.
_RENEWAL = 0.2  # [s] between two pushes when nothing changes.


@dataclass(frozen=True, slots=True)
class _Held:
    wrench: tuple[float, ...]
    link: int | None
    point: tuple[float, ...] | None


class ExternalForceHold(Closeable):
    """Pushes one virtual arm while it is held.

    Args:
        world: The arm's world port; closed with this object.
    """

    def __init__(self, world: SimulationControl) -> None:
        self._world = world
        self._condition = threading.Condition()
        self._wanted: _Held | None = None
        self._held_at = 0.0
        self._is_ending = False
        self._error: RcilabError | None = None
        self._thread = threading.Thread(target=self._run, name="held push", daemon=True)
        self._thread.start()

    def hold(self, wrench: ArrayLike, link: int | None = None, point: ArrayLike | None = None) -> None:
        """Pushes, or goes on pushing, for the next 0.4 s; returns at once.

        Args:
            wrench: Force and moment, base axes, shape (6,), [N, N m].
            link: Number of the link, from 1; None: the tool.
            point: Where the force acts, in the frame of the link (or the tool), shape (3,), [m]; None: at its origin.

        Raises:
            InvalidValueError: Not six and three finite numbers.
        """
        place = None if point is None else tuple(as_vector(point, 3, "point", "m").tolist())
        held = _Held(tuple(as_vector(wrench, 6, "wrench", "N, N m").tolist()), link, place)
        with self._condition:
            self._wanted, self._held_at = held, time.monotonic()
            self._condition.notify()

    def release(self) -> None:
        """Lets go; returns at once."""
        with self._condition:
            self._wanted = None
            self._condition.notify()

    def take_error(self) -> RcilabError | None:
        """Returns what has gone wrong since the last call, such as a controller that is gone; None: nothing."""
        with self._condition:
            error, self._error = self._error, None
            return error

    def close(self) -> None:
        """Lets go and ends the thread. May be called twice."""
        with self._condition:
            self._wanted, self._is_ending = None, True
            self._condition.notify()
        self._thread.join(2.0)  # It may be waiting for a controller that hangs: then it ends after that.

    def _run(self) -> None:
        pushing: _Held | None = None
        while True:
            with self._condition:
                if self._wanted == pushing and not self._is_ending:
                    self._condition.wait(None if pushing is None else _RENEWAL)
                if self._wanted is not None and time.monotonic() - self._held_at > HOLD_TIMEOUT:
                    self._wanted = None
                wanted, is_ending = self._wanted, self._is_ending
            try:
                if wanted is not None:
                    self._world.push(wanted.wrench, wanted.link, wanted.point, _LENGTH)
                elif pushing is not None:
                    self._world.release()
                pushing = wanted
            except RcilabError as error:
                with self._condition:
                    self._error, self._wanted, pushing = error, None, None
            if is_ending:
                self._world.close()
                return
