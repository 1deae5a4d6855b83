"""Restores the last workbench's program, configuration, cell and view settings; after a crash the goal, too."""

from __future__ import annotations

import json
import os
import time
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

from rcilab.app.cell.cell_backup import CellBackup
from rcilab.app.setup.configuration_json import build_setup, setup_facts
from rcilab.core.arrays import JointVector, as_vector, readonly_copy
from rcilab.core.atomic_file import read_own_text, write_atomic
from rcilab.core.errors import RcilabError
from rcilab.makers.configuration import RobotConfiguration
from rcilab.model.robot_model import load_model
from rcilab.motion.program import Program

if TYPE_CHECKING:
    from rcilab.app.store import UiState
    from rcilab.cell.cell import Cell
    from rcilab.model.robot_model import RobotModel

_FORMAT, _VERSION = "rcilab workbench", 1
Look: TypeAlias = Literal["language", "theme", "angle", "length"]
_AT_FIRST: dict[Look, str] = {"language": "en", "theme": "light", "angle": "deg", "length": "mm"}
_PAUSE = 1.0  # [s] Minimum time between two writes, during a drag.


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class SavedState:
    """The restored values of one arm."""

    q: JointVector | None
    """The goal, shape (n,), [rad]; None after a regular end of the workbench."""
    program: Program | None = None
    setup: RobotConfiguration = field(default_factory=RobotConfiguration)
    """The edited parts of the configuration."""
    cell: Cell | None = None


def looks_of(state: UiState) -> dict[Look, str]:
    """Returns the page's settings that differ from their defaults, by the names in `SetView`."""
    looks: dict[Look, str] = {
        "language": state.language,
        "theme": state.theme,
        "angle": state.units.angle,
        "length": state.units.length,
    }
    return {name: value for name, value in looks.items() if value != _AT_FIRST[name]}


def autosave_file(port: int) -> Path:
    """Returns the file of the workbench at a port: in $XDG_STATE_HOME/rcilab, or ~/.local/state/rcilab."""
    home = os.environ.get("XDG_STATE_HOME", "")
    folder = Path(home) if os.path.isabs(home) else Path.home() / ".local" / "state"
    return folder / "rcilab" / f"workbench-{port}.json"


class Autosave:
    """Writes the view settings, and goal, program, configuration and cell of every arm, when they have changed.

    Owned by the dispatcher's thread.

    The operator did not ask for this file, so where it cannot be written or read it is skipped silently.

    Args:
        file: The file; it belongs to the process that holds the port in its name. None: nothing is saved.
    """

    def __init__(self, file: Path | None) -> None:
        self._file = file
        self._cells = None if file is None else CellBackup(file.with_suffix(".meshes"))
        self._arms: dict[str, Any] = {}
        self._looks: dict[Look, str] = {}
        self._written: tuple[object, ...] | None = None
        self._next = 0.0

    def recall(self, model: RobotModel) -> SavedState | None:
        """Returns what the previous workbench saved of an arm, if the file is valid."""
        if self._file is None:
            return None
        try:
            content: dict[str, Any] = json.loads(read_own_text(self._file))
            if (content["format"], content["version"]) != (_FORMAT, _VERSION):
                return None
            self._arms = dict(content["arms"])
            self._looks = dict(content.get("looks") or {})
            own = self._arms.get(model.name)
            if own is None:
                return None
            program = None if own["program"] is None else Program.from_json(own["program"])
            q = None if own.get("q") is None else readonly_copy(as_vector(own["q"], model.n, "q", "rad"))
            setup = build_setup(own.get("setup") or {})
            setup.applied_to(model)  # A load above the arm's payload is not restored.
            return SavedState(q=q, program=program, setup=setup, cell=self._cell_of(own))
        except (OSError, ValueError, LookupError, TypeError, AttributeError, RecursionError, RcilabError):
            return None

    def recall_looks(self) -> dict[Look, str]:
        """Returns the saved settings of the page, by their names in `SetView`; after `recall`."""
        return dict(self._looks)

    def recall_setups(self, model: RobotModel) -> dict[str, RobotConfiguration]:
        """Returns the edited configurations of the other arms, by name; after `recall`."""
        found: dict[str, RobotConfiguration] = {}
        for name, own in self._arms.items():
            with suppress(ValueError, LookupError, TypeError, AttributeError, RcilabError):
                setup = build_setup(own.get("setup") or {})
                if name != model.name and setup.parts:
                    setup.applied_to(load_model(name))
                    found[name] = setup
        return found

    def recall_programs(self, model: RobotModel) -> tuple[Program, ...]:
        """Returns the programs of the other arms; after `recall`."""
        found: list[Program] = []
        for name, own in self._arms.items():
            with suppress(ValueError, LookupError, TypeError, AttributeError, RecursionError, RcilabError):
                if name != model.name and own["program"] is not None:
                    found.append(Program.from_json(own["program"]))
        return tuple(found)

    def recall_cells(self, model: RobotModel) -> tuple[Cell, ...]:
        """Returns the cells of the other arms; after `recall`."""
        found: list[Cell] = []
        for name, own in self._arms.items():
            with suppress(ValueError, LookupError, TypeError, AttributeError, RecursionError, RcilabError):
                cell = self._cell_of(own)
                if name != model.name and cell is not None:
                    found.append(cell)
        return tuple(found)

    def _cell_of(self, own: dict[str, Any]) -> Cell | None:
        text = own.get("cell")
        return None if text is None or self._cells is None else self._cells.cell_of(text)

    def keep(self, state: UiState) -> None:
        """Writes changes, at most once a second."""
        now = time.monotonic()
        content = (
            state.model.name,
            state.goal.q.tobytes(),
            state.program.draft,
            state.setup.wanted,
            state.setup.touched,
            state.cell.cell,
            (looks := looks_of(state)),
        )
        if self._file is None or content == self._written or now < self._next:
            return
        self._written, self._next = content, now + _PAUSE
        draft = state.program.draft
        program = draft.program(state.model) if draft.model == state.model.name else None
        self._arms[state.model.name] = {
            "q": state.goal.q.tolist(),
            "program": None if program is None else program.to_json(),
            "setup": setup_facts(state.setup.wanted.only(state.setup.touched)),
        }
        self._looks = looks
        with suppress(OSError):
            if state.cell.cell is not None and self._cells is not None:
                self._arms[state.model.name]["cell"] = self._cells.text_of(state.cell.cell)
            self._write(self._arms)

    def close(self, state: UiState) -> None:
        """Forgets goals, at a regular end of the workbench; all else is kept."""
        if self._file is None:
            return
        self._next = 0.0
        self.keep(state)
        arms = {
            name: {"program": own.get("program"), "setup": own.get("setup") or {}, "cell": own.get("cell")}
            for name, own in self._arms.items()
            if own.get("program") or own.get("setup") or own.get("cell")
        }
        with suppress(OSError):
            if arms or self._looks:
                self._write(arms)
            else:
                self._file.unlink(missing_ok=True)
        if self._cells is not None:
            self._cells.clean()

    def _write(self, arms: dict[str, Any]) -> None:
        assert self._file is not None
        text = json.dumps({"format": _FORMAT, "version": _VERSION, "arms": arms, "looks": self._looks})
        write_atomic(self._file, text, survives_power_loss=False)
