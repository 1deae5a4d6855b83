"""What went wrong, as a message: in the words of the catalogues where the error says which."""

from __future__ import annotations

from collections.abc import Mapping
from functools import reduce
from typing import Any

from rcilab.core.errors import InvalidValueError, RcilabError
from rcilab.i18n.translator import Amount, Finished, Message, Remark, message

_NAMES = frozenset({"status", "kind", "condition", "feature"})
"""Facts that are names with words of their own: the answer to a command, the type of a waypoint, a condition, a feature
that an arm lacks."""
_REQUIREMENTS = frozenset(
    {
        "span", "least", "rounds", "missing", "missing_beside", "unknown", "axes", "turns", "no_unit", "beyond",
        "no_number", "numbers", "target_shape", "not_finite", "no_meaning", "no_target", "second_target",
        "second_angle", "six_axes",
        "no_direction", "one_line", "box_size", "table_cell", "table_columns", "table_titles", "table_twice",
        "table_order",
    }
)  # fmt: skip
"""What a value has to be, and is not: said alone, these name it first."""
_PLACES = {"waypoint": "waypoint_error", "way": "way_error", "way_to_start": "way_error", "blend": "way_error"}
"""What is not about a target: a waypoint of a program, or the way to one; and where its words for what is in
`_ADVISING` are."""
_ADVISING = frozenset({"too_far", "too_close", "no_angles", "joint_beyond", "joint_beyond_soft", "no_motion"})
"""Reasons whose words say what to do with the target."""
_SHOWN = 40  # Characters of a value that is repeated.


def tell(error: RcilabError) -> Message | Finished:
    """Returns an error for a face to say; one without a code keeps its English sentence, in the units of the face."""
    said = _tell_reason(error)
    if isinstance(error, InvalidValueError) and error.code in _REQUIREMENTS:
        value = str(error.value)
        shown = value if len(value) <= _SHOWN else value[: _SHOWN - 1] + "…"
        return message("value.unfit", name=error.name, value="" if error.value is None else shown, reason=said)
    return said


def tell_note(note: str) -> Message | Finished:
    """Returns what a planner or a controller remarks; a note without a code keeps its English sentence."""
    if not (isinstance(note, Remark) and note.code):
        return Finished(note)
    if len(note.parts) != 1:
        parts = [tell_note(part) for part in note.parts] or [Finished(note)]
        return reduce(_both, reversed(parts))
    facts: dict[str, Any] = {
        name: tell_note(fact) if isinstance(fact, Remark) else fact for name, fact in note.facts.items()
    }
    if "unit" in facts:
        value, bound, unit = float(facts["value"]), float(facts["bound"]), str(facts.pop("unit"))
        facts |= {"value": Amount(value, bound, unit), "bound": Amount(bound, value, unit)}
    return message(f"remark.{note.code}", **_named(facts))


def _both(second: Message | Finished, first: Message | Finished) -> Message | Finished:
    return message("remark.both", first=first, second=second)


def _tell_reason(error: RcilabError, about: str = "error") -> Message | Finished:
    if not error.code:
        return Finished(str(error))
    inner = _PLACES.get(error.code, about)
    facts = {
        name: _tell_reason(fact, inner) if isinstance(fact, RcilabError) else fact for name, fact in error.facts.items()
    }
    return message(f"{about if error.code in _ADVISING else 'error'}.{error.code}", **_named(facts))


def _named(facts: Mapping[str, object]) -> dict[str, object]:
    """Returns facts with names that have words of their own put into words."""
    names = {name: message(f"{name}.{str(facts[name]).replace(' ', '_')}") for name in _NAMES & facts.keys()}
    return {**facts, **names}
