"""An external force that lasts while it is held: the caller renews it, and without renewal it ends.

    with ExternalForceHold(SimulationControl(host, port)) as push:
        while the_button_is_down():
            push.hold([0, 20, 0, 0, 0, 0], link=4)
            time.sleep(0.1)

A thread waits for the simulation port, not the caller. The virtual controller only receives pushes with a duration, so
that a push ends even if this process dies.
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

HOLD_TIMEOUT = 0.4  # [s] without `hold` after which a push ends: a page renews it ten times a second.
_LENGTH = 0.5  # [s] Duration of each push in the controller's time; longer than the renewal below.
_RENEWAL = 0.2  # [s] between two pushes when nothing changes.


@dataclass(frozen=True, slots=True)
class _Held:
    wrench: tuple[float, ...]
    link: int | None
    point: tuple[float, ...] | None


class ExternalForceHold(Closeable):
    """Pushes one virtual arm while the force is held.

    Args:
        world: The arm's simulation port; closed with this object.
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
        """Applies or renews the force for the next 0.4 s; returns at once.

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
        """Removes the force; returns at once."""
        with self._condition:
            self._wanted = None
            self._condition.notify()

    def take_error(self) -> RcilabError | None:
        """Returns an error since the last call, such as a lost controller, or None."""
        with self._condition:
            error, self._error = self._error, None
            return error

    def close(self) -> None:
        """Removes the force and ends the thread. May be called twice."""
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
