"""Requests that store, recall or delete a named pose. Owned by the dispatcher's thread."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

from rcilab.app.goal.goal_actions import GoalActions
from rcilab.app.request import Handlers, Request
from rcilab.app.store import Store
from rcilab.core.errors import InvalidValueError, RcilabError
from rcilab.i18n.error_messages import describe_error
from rcilab.i18n.translator import LiteralText, message
from rcilab.motion.named_poses import LONGEST_NAME, NamedPoseStore


@dataclass(frozen=True, slots=True, kw_only=True)
class NamedPose(Request):
    """A button or field of the stored poses."""

    what: Literal["store", "recall", "delete", "choose"]
    name: str


class NamedPoseActions:
    """The stored poses of the chosen arm.

    Args:
        store: The state.
        goal: Sets the goal.
        file: File of the poses; None: the one in the user's folder.
    """

    def __init__(self, store: Store, goal: GoalActions, file: Path | None = None) -> None:
        self._store, self._goal, self._file = store, goal, file
        self._shown = ""

    @property
    def handlers(self) -> Handlers:
        """The handlers of its requests."""
        return {
            NamedPose: self.act,
        }

    def act(self, request: NamedPose) -> None:
        """Stores the goal under a name, or recalls, deletes or selects the pose of this name."""
        {"store": self._keep, "recall": self._recall, "delete": self._delete, "choose": self._choose}[request.what](
            request.name
        )

    def tick(self) -> None:
        """Loads the poses of another arm."""
        if self._store.state.model.name != self._shown:
            self._shown = self._store.state.model.name
            self._try(self._show)

    def _keep(self, name: str) -> None:
        name = name.strip()
        if not name or len(name) > LONGEST_NAME or not name.isprintable():
            self._store.notify("warn", message("poses.no_name", longest=LONGEST_NAME))
        elif name in self._store.state.jog.poses:
            self._store.notify("warn", message("poses.taken", name=name))
        elif self._try(lambda: self._book.store(name, self._store.state.goal.q)):
            self._try(lambda: self._show(name))
            self._store.notify("good", message("poses.stored", name=name))

    def _recall(self, name: str) -> None:
        def pose() -> None:
            q = self._book.recall(name)
            self._store.push_undo()
            self._goal.set_joints(q)

        if not name:
            self._store.notify("warn", message("poses.none"))
        else:
            self._try(pose)

    def _delete(self, name: str) -> None:
        if not name:
            self._store.notify("warn", message("poses.none"))
        elif self._try(lambda: self._book.delete(name)):
            self._try(self._show)

    def _choose(self, name: str) -> None:
        jog = self._store.state.jog
        if name in jog.poses:
            self._store.update(jog=replace(jog, pose=name))

    @property
    def _book(self) -> NamedPoseStore:
        return NamedPoseStore(self._store.state.model, self._file)

    def _show(self, chosen: str | None = None) -> None:
        names = self._book.names()
        wanted = self._store.state.jog.pose if chosen is None else chosen
        pose = wanted if wanted in names else (names[0] if names else "")
        self._store.update(jog=replace(self._store.state.jog, poses=names, pose=pose))

    def _try(self, act: Callable[[], object]) -> bool:
        try:
            act()
        except RcilabError as error:
            plain = error.requirement if isinstance(error, InvalidValueError) else str(error)
            reason = describe_error(error) if error.code else LiteralText(plain)
            self._store.notify("bad", message("poses.file", file=self._book.file, reason=reason))
            if isinstance(error, InvalidValueError) and error.name == "pose":
                self._try(self._show)  # Another process has deleted it.
            return False
        return True
