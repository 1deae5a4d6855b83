"""The program that is edited: values, and edits that return new ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from itertools import count

import numpy as np

from rcilab.app.goal.goal import Tone
from rcilab.app.planning import Plan
from rcilab.cell.cell import Cell
from rcilab.cell.entries import Frame
from rcilab.core.errors import InvalidValueError
from rcilab.core.safety_box import SafetyBox
from rcilab.core.spatial import Pose
from rcilab.i18n.translator import Message, Remark, message
from rcilab.model.robot_model import RobotModel
from rcilab.motion.program import Program, box_numbers, payload_numbers, payload_of, tool_numbers
from rcilab.motion.waypoint import Waypoint
from rcilab.motion.waypoint_types import BLOCKS, Floats, WaypointType

TYPES: tuple[WaypointType, ...] = ("joint", "line", "arc", "free")
"""The types with a target, which can be exchanged for each other."""
FILE_FIELD = "program.0.file"
"""Name of a problem of a file in `UiState.problems`."""
MOST_ROUNDS = 100
"""Largest number of rounds: a longer motion could not be inspected."""

_SAME_TIME = 1e-9  # [s]

_KEYS = count(1)


@dataclass(frozen=True, slots=True)
class Step:
    """A waypoint with a key that distinguishes it from all others, equal or not."""

    key: int
    waypoint: Waypoint


@dataclass(frozen=True, slots=True, eq=False, kw_only=True)
class Draft:
    """A program that may be empty."""

    model: str = ""
    """Name of the arm; "" for an empty draft."""
    start: Floats | None = None
    """Joint angles at the start, [rad]; None until there is a waypoint."""
    steps: tuple[Step, ...] = ()
    name: str = ""
    tool: Floats | None = None
    """Pose of the tool in the flange frame, as in `Program`; None: the tool of the page."""
    payload: Floats | None = None
    """The load, as in `Program`; None: that of the page."""
    box: Floats | None = None
    """The safety box of its file, as in `Program`; the page plans with its own."""

    def index(self, key: int | None) -> int | None:
        """Returns the index of a step, from 0, or None for an unknown key."""
        return next((index for index, step in enumerate(self.steps) if step.key == key), None)

    def waypoint(self, key: int | None) -> Waypoint | None:
        """Returns the waypoint of a step, or None."""
        index = self.index(key)
        return None if index is None else self.steps[index].waypoint

    def inserted(self, waypoint: Waypoint, after: int | None) -> tuple[Draft, int]:
        """Returns the draft with one more waypoint, after a step or at the end, and its key."""
        index, step = self.index(after), Step(next(_KEYS), waypoint)
        at = len(self.steps) if index is None else index + 1
        return replace(self, steps=(*self.steps[:at], step, *self.steps[at:])), step.key

    def wrapped(self, begin: Waypoint, end: Waypoint, first: int | None, last: int | None) -> tuple[Draft, int]:
        """Returns the draft with a block around its steps from one to another, and the key of the block's begin."""
        low, high = self.index(first), self.index(last)
        if low is None or high is None:
            low, high = len(self.steps), len(self.steps) - 1
        opening, closing = Step(next(_KEYS), begin), Step(next(_KEYS), end)
        inner = self.steps[low : high + 1]
        return replace(self, steps=(*self.steps[:low], opening, *inner, closing, *self.steps[high + 1 :])), opening.key

    def without(self, *keys: int) -> Draft:
        """Returns the draft without some steps; with one end of a block, its other end is left out, too."""
        gone = {*keys, *(self.partner(key) for key in keys)}
        return replace(self, steps=tuple(step for step in self.steps if step.key not in gone))

    def chosen(self, selected: int | None, marked: frozenset[int]) -> tuple[int, ...]:
        """Returns the keys of the selected steps, in their order."""
        return tuple(step.key for step in self.steps if step.key == selected or step.key in marked)

    def with_partners(self, keys: Sequence[int]) -> tuple[Step, ...]:
        """Returns steps in their order, with the whole of each block of which one has an end."""
        ends = {key: self.partner(key) for key in keys}
        wanted = set(keys)
        for key, partner in ends.items():
            low, high = sorted((self.index(key) or 0, self.index(partner) or 0)) if partner is not None else (0, -1)
            wanted |= {step.key for step in self.steps[low : high + 1]}
        return tuple(step for step in self.steps if step.key in wanted)

    def shifted(self, keys: Sequence[int], step: int) -> Draft:
        """Returns the draft with steps moved up (-1) or down (1) by one; itself if they are at the end."""
        indices = [index for index, one in enumerate(self.steps) if one.key in set(keys)]
        if not indices or not (0 <= indices[0] + step and indices[-1] + step < len(self.steps)):
            return self
        steps = list(self.steps)
        for index in indices if step < 0 else reversed(indices):
            steps[index], steps[index + step] = steps[index + step], steps[index]
        return replace(self, steps=tuple(steps))

    def partner(self, key: int) -> int | None:
        """Returns the key of the end of the block that a step begins, or of its begin; None for any other step."""
        opened: list[int] = []
        for step in self.steps:
            if step.waypoint.type in BLOCKS:
                opened.append(step.key)
            elif step.waypoint.type == "end" and opened:
                begin = opened.pop()
                if key in (begin, step.key):
                    return step.key if key == begin else begin
        return None

    @property
    def depths(self) -> tuple[int, ...]:
        """Number of blocks that each step is in."""
        found, depth = list[int](), 0
        for step in self.steps:
            depth -= step.waypoint.type == "end" and depth > 0
            found.append(depth)
            depth += step.waypoint.type in BLOCKS
        return tuple(found)

    def moved(self, key: int, to: int) -> Draft:
        """Returns the draft with a step at another index, from 0, or at the nearest end."""
        step = next(step for step in self.steps if step.key == key)
        others = [other for other in self.steps if other.key != key]
        others.insert(min(max(to, 0), len(others)), step)
        return replace(self, steps=tuple(others))

    def changed(self, key: int, waypoint: Waypoint) -> Draft:
        """Returns the draft with another waypoint in a step."""
        return replace(self, steps=tuple(Step(key, waypoint) if step.key == key else step for step in self.steps))

    def program(self, model: RobotModel, upto: int | None = None, box: SafetyBox | None = None) -> Program | None:
        """Returns the program, or its part up to a step; None if it is empty.

        Tool, load and safety box of the page are written into it, so that file and script describe the same motion
        anywhere.

        Args:
            model: The arm of the page.
            upto: Key of the last step; None: all.
            box: The safety box of the page.
        """
        last = self.index(upto)
        steps = self.steps if last is None else self.steps[: last + 1]
        if not steps or self.start is None:
            return None
        waypoints = tuple(step.waypoint for step in steps)
        if last is not None:
            waypoints = _closed(waypoints)
        return Program(
            model=self.model,
            start=self.start,
            waypoints=waypoints,
            name=self.name,
            tool=self.tool or tool_numbers(model.T_flange_tool),
            payload=self.payload or (payload_numbers(model.load) if model.load.mass > 0.0 else None),
            box=self.box or (box_numbers(box) if box is not None and box.active else None),
        )

    def is_for(self, model: RobotModel) -> bool:
        """Returns whether the program is for tool and load of the page."""
        arm = self.arm(model)
        numbers, here = payload_numbers(arm.load), payload_numbers(model.load)
        same_load = self.payload is None or np.allclose(numbers, here, rtol=0.0, atol=1e-9)
        return bool(same_load) and (self.tool is None or arm.T_flange_tool.is_close(model.T_flange_tool))

    def has_other_box(self, box: SafetyBox | None) -> bool:
        """Returns whether the program has a safety box, and the page another one or none."""
        if self.box is None:
            return False
        here = None if box is None or not box.active else box_numbers(box)
        return here is None or not np.allclose(self.box, here, rtol=0.0, atol=1e-9)

    def arm(self, model: RobotModel) -> RobotModel:
        """Returns the arm with the tool and the load that this program is for."""
        changed = model if self.tool is None else model.with_tool(Pose(self.tool[:3], self.tool[3:]))
        return changed if self.payload is None else changed.with_load(payload_of(self.payload))


def _closed(waypoints: tuple[Waypoint, ...]) -> tuple[Waypoint, ...]:
    """Returns the first steps of a program with the blocks that have begun run once, up to there."""
    opened: list[int] = []
    for index, waypoint in enumerate(waypoints):
        if waypoint.type in BLOCKS:
            opened.append(index)
        elif waypoint.type == "end" and opened:
            opened.pop()
    steps = [Waypoint.group("") if index in opened else waypoint for index, waypoint in enumerate(waypoints)]
    return (*steps, *(Waypoint.end() for _ in opened))


@dataclass(frozen=True, slots=True)
class Note:
    """A remark of the planner, about one step or about all."""

    remark: str
    """A `Remark` if it has a text in the catalogues."""
    key: int | None
    """Key of the step; None: about the whole program."""

    @property
    def code(self) -> str:
        """Code of the remark; "" for a plain sentence."""
        return self.remark.code if isinstance(self.remark, Remark) else ""


@dataclass(frozen=True, eq=False, kw_only=True)
class ProgramState:
    """The state of the Program tab."""

    draft: Draft = field(default_factory=Draft)
    selected: int | None = None
    """Key of a step."""
    marked: frozenset[int] = frozenset()
    """Keys of further selected steps."""
    scrolled: int | None = None
    """Index of the step to which the list was scrolled; None: the selected step is in sight."""
    can_undo: bool = False
    can_redo: bool = False
    rounds: int = 1
    """Number of rounds."""
    is_script_shown: bool = False
    progress: float | None = None
    """Progress of the planning, 0 to 1."""
    planned: Draft | None = None
    """The program that was planned last."""
    tone: Tone = "good"
    answer: Message | None = None
    """The result next to the plan: the approach to the start, or why it failed."""
    notes: tuple[Note, ...] = ()
    """The planner's remarks about the plan."""
    failed: int | None = None
    """Key of the step that cannot be planned, or that violates a condition."""


def notes_of(plan: Plan, steps: tuple[Step, ...]) -> tuple[Note, ...]:
    """Returns the planner's remarks about a plan, each once, for any number of rounds.

    Args:
        plan: Plan of a program.
        steps: The steps of that program.
    """
    notes: dict[tuple[str, int | None], Note] = {}
    for remark in plan.motion.notes:
        number = remark.facts.get("number") if isinstance(remark, Remark) else None
        key = steps[number - 1].key if isinstance(number, int) and 0 < number <= len(steps) else None
        notes.setdefault((remark, key), Note(remark, key))
    return tuple(notes.values())


def draft_of(program: Program, model: RobotModel) -> Draft:
    """Returns a program as a draft; if it is for tool and load of the page, it follows their changes.

    Args:
        program: The program.
        model: The arm of the page, with its tool.
    """
    steps = tuple(Step(next(_KEYS), waypoint) for waypoint in program.waypoints)
    draft = Draft(
        model=program.model,
        start=program.start,
        steps=steps,
        name=program.name,
        tool=program.tool,
        payload=program.payload,
        box=program.box,
    )
    return replace(draft, tool=None, payload=None) if draft.is_for(model) else draft


def target_of(waypoint: Waypoint, arm: RobotModel) -> Pose | None:
    """Returns the pose of the tool at a waypoint, in its frame; None if it depends on the previous waypoint."""
    return waypoint.pose if waypoint.q is None else arm.forward(waypoint.q)


def target_in_base(waypoint: Waypoint, arm: RobotModel) -> Pose | None:
    """Returns the pose of the tool at a waypoint of a placed draft; None if it is not known."""
    return None if waypoint.frame is not None else target_of(waypoint, arm)


def placed(draft: Draft, cell: Cell | None) -> Draft:
    """Returns the program with its waypoints in base, the same one for the same arguments.

    A waypoint whose frame the cell does not have stays in its frame.
    """
    return draft if cell is None else _placed(draft, cell.model, cell.frames, cell.T_world_base)


@lru_cache(maxsize=8)
def _placed(draft: Draft, model: str, frames: tuple[Frame, ...], T_world_base: Pose) -> Draft:
    """Returns the program in base; an obstacle that moves changes none of the arguments."""
    if all(step.waypoint.frame is None for step in draft.steps):
        return draft
    poses = Cell(model=model, frames=frames, T_world_base=T_world_base).frame_poses
    return replace(draft, steps=tuple(Step(step.key, _in_base(step.waypoint, poses)) for step in draft.steps))


def _in_base(waypoint: Waypoint, poses: dict[str, Pose]) -> Waypoint:
    if waypoint.frame not in poses:
        return waypoint
    try:
        return waypoint.in_base(poses[waypoint.frame])
    except InvalidValueError:  # Too far away, which planning reports.
        return waypoint


def is_led_in(plan: Plan) -> bool:
    """Returns whether the plan of a program begins with the approach to its start."""
    return (len(plan.motion.segment_starts) + 1) % (len(plan.steps) + 1) == 1


def number_at(plan: Plan, time: float) -> int | None:
    """Returns the number of the waypoint that the motion leads to at a time, from 1; 0 during the approach.

    At the time of a waypoint it is that waypoint, whatever the rounding.
    """
    if plan.program is None:
        return None
    before = max(time - _SAME_TIME, 0.0)
    segment = int(np.searchsorted(plan.motion.segment_starts, before, side="right")) - 1 - is_led_in(plan)
    index = segment % (len(plan.steps) + 1)
    return 0 if segment < 0 or index >= len(plan.steps) else plan.steps[index]


def time_at(plan: Plan, number: int) -> float:
    """Returns the time at which the motion first reaches the end of a waypoint's segment, with its dwell, [s]."""
    index = next((index for index, step in enumerate(plan.steps) if step >= number), len(plan.steps) - 1)
    while plan.steps[index + 1 : index + 2] == (number,):
        index += 1
    segment = index + is_led_in(plan)
    starts = plan.motion.segment_starts
    return float(starts[segment + 1]) if segment + 1 < len(starts) else plan.motion.duration


def waypoint_times(plan: Plan) -> list[tuple[int, float]]:
    """Returns number and time, [s], of each arrival at a waypoint of a program's plan, with its dwell."""
    if plan.program is None:
        return []
    starts = plan.motion.segment_starts
    ends = [*map(float, starts[1:]), plan.motion.duration]
    numbers = [number_at(plan, end) for end in ends]
    after = [*numbers[1:], None]
    return [(here, end) for here, end, next in zip(numbers, ends, after, strict=True) if here and here != next]


def describe_place(plan: Plan, time: float) -> Message | None:
    """Returns the name of the segment at a time of a program's plan."""
    number = number_at(plan, time)
    if number is None or plan.program is None:
        return None
    if number == 0:
        return message("program.at_start")
    kind = message(f"program.type.{plan.program.waypoints[number - 1].type}")
    return message("program.at", number=number, count=len(plan.program.waypoints), kind=kind)


def describe_step(waypoint: Waypoint) -> Message:
    """Returns what a step does at which nothing moves, in a few words."""
    level = message(f"program.level.{'on' if waypoint.level else 'off'}")
    name = waypoint.text or ""
    match waypoint.type:
        case "wait":
            return message("program.step.wait", seconds=f"{waypoint.dwell:g}")
        case "input":
            return message(
                "program.step.input", signal=waypoint.signal, level=level, seconds=f"{waypoint.timeout or 0.0:g}"
            )
        case "output":
            return message("program.step.output", signal=waypoint.signal, level=level)
        case "tool":
            jaws = message(f"program.jaws.{waypoint.jaws}")
            return message("program.step.tool", jaws=jaws, seconds=f"{waypoint.dwell:g}")
        case "repeat":
            named = f" \N{EN DASH} {name}" if name else ""
            if waypoint.signal is None:
                return message("program.step.repeat", count=waypoint.count, name=named)
            return message("program.step.until", count=waypoint.count, signal=waypoint.signal, level=level, name=named)
        case _:
            return message("program.step.text", text=name)
