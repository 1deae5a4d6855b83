"""What only changes how the page looks, and who is there to see it. Owned by the conductor's thread."""

from __future__ import annotations

import math

from rcilab.workbench import requests
from rcilab.workbench.learn.state import exhibited
from rcilab.workbench.store import Store
from rcilab.workbench.text import LANGUAGES, message

QUALITIES = ("full", "light")
RATES = (0.1, 0.25, 0.5, 1.0, 2.0)


class ViewActions:
    """Timeline, settings, pages that come and go."""

    def __init__(self, store: Store) -> None:
        self._store = store

    def seek(self, request: requests.Seek) -> None:
        """Holds the preview at a place of the plan."""
        if math.isfinite(request.place):
            self._store.update(place=min(max(request.place, 0.0), 1.0), playing=False)

    def play(self, request: requests.Play) -> None:
        """Starts the preview, from the beginning when it stands at the end, or holds it."""
        state = exhibited(self._store.state)
        playing = not state.playing if request.playing is None else request.playing
        if state.plan is None:
            self._store.say("warn", message("ready.no_plan"))
        elif playing:
            self._store.update(playing=True, place=0.0 if state.place >= 1.0 else state.place)
        else:
            self._store.update(playing=False)

    def advance(self, elapsed: float) -> None:
        """Moves a playing preview on by `elapsed`, [s]."""
        state = exhibited(self._store.state)
        if not state.playing or state.plan is None:
            return
        place = state.place + elapsed * state.rate / max(state.plan.motion.duration, 1e-3)
        if state.loop and place >= 1.0:
            place = 0.0
        self._store.update(place=min(place, 1.0), playing=place < 1.0)

    def set_view(self, request: requests.SetView) -> None:
        """Changes a setting; values that do not exist are ignored."""
        value = request.value
        known = {
            "language": value in LANGUAGES,
            "quality": value in QUALITIES,
            "rate": value in RATES,
            "height": isinstance(value, float),
            "loop": isinstance(value, bool),
            "plot_joint": isinstance(value, int) and 0 <= value <= self._store.state.model.n,
        }
        if known.get(request.name, False):
            self._store.update(**{request.name: value})

    def set_recording(self, request: requests.SetRecording) -> None:
        """Has the next motions written to files, or not."""
        self._store.update(record=request.on)

    def page_came(self, request: requests.PageCame) -> None:
        """Notes a page; the first one gets the controls."""
        if request.page is not None:
            self._store.update(lease=self._store.state.lease.arrive(request.page))

    def page_went(self, request: requests.PageWent) -> None:
        """Notes that a page has gone."""
        if request.page is not None:
            self._store.update(lease=self._store.state.lease.leave(request.page))

    def take_controls(self, request: requests.TakeControls) -> None:
        """Hands the controls to the page that asks."""
        if request.page is None or self._store.state.lease.allows(request.page):
            return
        lease = self._store.state.lease.take(request.page)
        self._store.update(lease=lease)
        self._store.say("warn", message("notice.taken", page=lease.number(request.page)))
