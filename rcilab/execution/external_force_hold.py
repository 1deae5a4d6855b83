"""An external force that lasts while the caller renews it.

    with ExternalForceHold(SimulationControl(host, port)) as push:
        while button_is_pressed():
            push.hold([0, 20, 0, 0, 0, 0], link=4)
            time.sleep(0.1)

A thread sends the requests, so that the caller does not wait. The virtual controller receives only pushes with a
duration, so that a push ends even after a crash of this process.
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

HOLD_TIMEOUT = 0.4  # [s] Without a call of `hold` until a push ends: a page calls it ten times a second.
_DURATION = 0.5  # [s] Duration of each push in the controller's time; longer than the period below.
_PERIOD = 0.2  # [s] Between two pushes without a change.


@dataclass(frozen=True, slots=True)
class _Held:
    wrench: tuple[float, ...]
    link: int | None
    point: tuple[float, ...] | None


class ExternalForceHold(Closeable):
    """Pushes a virtual arm while the force is held.

    Args:
        world: The arm's simulation port; closed with this object.
    """

    def __init__(self, world: SimulationControl) -> None:
        self._world = world
        self._condition = threading.Condition()
        self._requested: _Held | None = None
        self._held_at = 0.0
        self._is_ending = False
        self._error: RcilabError | None = None
        self._thread = threading.Thread(target=self._run, name="held push", daemon=True)
        self._thread.start()

    def hold(self, wrench: ArrayLike, link: int | None = None, point: ArrayLike | None = None) -> None:
        """Applies or renews the force for the next 0.4 s; returns at once.

        Args:
            wrench: Force and moment, base axes, shape (6,), [N, N m].
            link: Number of the link, from 1; None: the tool.
            point: Where the force acts, in the frame of the link (or the tool), shape (3,), [m]; None: at its origin.

        Raises:
            InvalidValueError: The wrench is not six finite numbers, or the point not three.
        """
        at = None if point is None else tuple(as_vector(point, 3, "point", "m").tolist())
        held = _Held(tuple(as_vector(wrench, 6, "wrench", "N, N m").tolist()), link, at)
        with self._condition:
            self._requested, self._held_at = held, time.monotonic()
            self._condition.notify()

    def release(self) -> None:
        """Removes the force; returns at once."""
        with self._condition:
            self._requested = None
            self._condition.notify()

    def pop_error(self) -> RcilabError | None:
        """Returns an error since the last call, such as a lost controller, or None."""
        with self._condition:
            error, self._error = self._error, None
            return error

    def close(self) -> None:
        """Removes the force and ends the thread. May be called twice."""
        with self._condition:
            self._requested, self._is_ending = None, True
            self._condition.notify()
        self._thread.join(2.0)  # A controller that hangs may delay its end.

    def _run(self) -> None:
        pushing: _Held | None = None
        while True:
            with self._condition:
                if self._requested == pushing and not self._is_ending:
                    self._condition.wait(None if pushing is None else _PERIOD)
                if self._requested is not None and time.monotonic() - self._held_at > HOLD_TIMEOUT:
                    self._requested = None
                requested, is_ending = self._requested, self._is_ending
            try:
                if requested is not None:
                    self._world.push(requested.wrench, requested.link, requested.point, _DURATION)
                elif pushing is not None:
                    self._world.release()
                pushing = requested
            except RcilabError as error:
                with self._condition:
                    self._error, self._requested, pushing = error, None, None
            if is_ending:
                self._world.close()
                return
