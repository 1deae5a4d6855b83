"""The hand of a Franka arm: two fingers that open, close, and hold an object between them. No sockets, no clock.

The figures are those of the data sheet of the Franka hand: 80 mm of stroke, 50 mm/s for each finger. An object is only
its width; unless it is set from outside, an object of the expected width is there for every grasp from a larger one.
"""

from __future__ import annotations

from dataclasses import dataclass

from rcilab.core.clock import CYCLE_TIME
from rcilab.makers.franka.wire.gripper import Grasp, HandStatus, Homing, MoveFingers

STROKE = 0.08  # [m]
LARGEST_SPEED = 0.1  # [m/s] Of the distance of the fingers.
LARGEST_FORCE = 140.0  # [N]
_LARGEST_COMMANDED_SPEED = 2.0 * LARGEST_SPEED
RANGES = (
    f"it takes widths of 0 to {1e3 * STROKE:g} mm, speeds above 0 up to {1e3 * _LARGEST_COMMANDED_SPEED:g} mm/s and "
    f"forces above 0 up to {LARGEST_FORCE:g} N"
)
"""What is commanded is within, as text."""
TEMPERATURE = 30  # [degC]
_HOMING_SPEED = 0.05  # [m/s]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Task:
    """What the fingers are doing."""

    request: Grasp | MoveFingers | Homing
    widths: tuple[float, ...]
    """Still to be reached, in order, [m]."""
    speed: float
    """[m/s]."""


class FrankaHand:
    """The fingers. Owned by the controller's loop.

    Attributes:
        width: Distance of the fingers, [m].
        max_width: Largest distance, known after homing; before, 0, [m].
        is_grasped: Whether an object is held.
        object_width: Width of the object between the fingers, [m]; 0: none; None: what a grasp expects.
    """

    def __init__(self) -> None:
        self.width = STROKE
        self.max_width = 0.0
        self.is_grasped = False
        self.object_width: float | None = None
        self._task: _Task | None = None

    @property
    def is_moving(self) -> bool:
        """Whether a command is carried out."""
        return self._task is not None

    def begin(self, request: Grasp | MoveFingers | Homing) -> HandStatus | None:
        """Begins a command; returns the status of its answer if it is refused."""
        match request:
            case Homing():
                self._task = _Task(request=request, widths=(0.0, STROKE), speed=_HOMING_SPEED)
            case MoveFingers(width=width, speed=speed) if _is_within(width, speed):
                self._task = _Task(request=request, widths=(width,), speed=speed)
            case Grasp(width=width, epsilon_inner=inner, epsilon_outer=outer, speed=speed, force=force) if (
                _is_within(width, speed) and inner >= 0.0 and outer >= 0.0 and 0.0 < force <= LARGEST_FORCE
            ):
                self._task = _Task(request=request, widths=(0.0,), speed=speed)
            case _:
                return HandStatus.FAIL
        self.is_grasped = False
        return None

    def stop(self) -> None:
        """Stops the fingers and lets go."""
        self._task, self.is_grasped = None, False

    def step(self) -> HandStatus | None:
        """Advances by one cycle; returns the status of a command that has ended."""
        task = self._task
        if task is None:
            return None
        goal = task.widths[0]
        if isinstance(task.request, Grasp):
            held = task.request.width if self.object_width is None else self.object_width
            goal = held if held <= self.width else 0.0  # It is not between fingers that are closer: they only close.
        step = task.speed * CYCLE_TIME
        way = goal - self.width
        if abs(way) > step:
            self.width += step if way > 0.0 else -step
            return None
        self.width = goal
        if len(task.widths) > 1:
            self._task = _Task(request=task.request, widths=task.widths[1:], speed=task.speed)
            return None
        self._task = None
        return self._finish(task.request)

    def _finish(self, request: Grasp | MoveFingers | Homing) -> HandStatus:
        if isinstance(request, Homing):
            self.max_width = STROKE
        if not isinstance(request, Grasp):
            return HandStatus.SUCCESS
        is_expected = request.width - request.epsilon_inner < self.width < request.width + request.epsilon_outer
        self.is_grasped = is_expected
        return HandStatus.SUCCESS if is_expected else HandStatus.UNSUCCESSFUL


def _is_within(width: float, speed: float) -> bool:
    return 0.0 <= width <= STROKE and 0.0 < speed <= _LARGEST_COMMANDED_SPEED
