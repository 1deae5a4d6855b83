"""Messages for errors and notes: texts of the catalogues where the error has a code, else its English text."""

from __future__ import annotations

from collections.abc import Mapping
from functools import reduce
from typing import Any

from rcilab.core.clearance import LinkPair, link_name
from rcilab.core.errors import InvalidValueError, RcilabError
from rcilab.i18n.translator import ComparedValue, LiteralText, Message, Remark, message

_NAMES = frozenset({"end", "status", "kind", "condition", "feature"})
"""Facts whose values have their own catalogue entries: the reply to a command, the type of a waypoint, a condition, a
feature that an arm does not have."""
_REQUIREMENTS = frozenset(
    {
        "span", "least", "rounds", "missing", "missing_beside", "unknown", "axes", "turns", "no_unit", "beyond",
        "no_number", "numbers", "target_shape", "not_finite", "no_meaning", "no_target", "second_target",
        "second_angle", "six_axes", "frame_of_angles",
        "no_direction", "one_line", "box_size", "table_cell", "table_columns", "table_titles", "table_twice",
        "table_order", "path_columns", "path_beyond", "path_orientation", "path_titles", "gcode_slash",
        "gcode_subprogram", "gcode_word", "gcode_large", "gcode_axis", "gcode_twice", "gcode_machine",
        "gcode_compensation",
        "gcode_cycle", "gcode_feed_mode", "gcode_unknown", "gcode_feed", "gcode_dwell", "gcode_no_motion",
        "gcode_no_start", "gcode_turns", "gcode_center", "gcode_no_center", "gcode_radius", "gcode_no_circle",
        "gcode_small",
    }
)  # fmt: skip
"""Codes of requirements on a value; their messages begin with the name of the value."""
_SCOPES = {"waypoint": "waypoint_error", "way": "way_error", "way_to_start": "way_error", "blend": "way_error"}
"""Prefix of the keys for the reasons in `_WITH_ADVICE`, by the code of the error that contains the reason: a waypoint,
or the path to one."""
_WITH_ADVICE = frozenset({"too_far", "too_close", "no_angles", "joint_beyond", "joint_beyond_soft", "no_motion"})
"""Reasons whose messages advise what to do with the target, the waypoint or the path."""
_MAX_SHOWN = 40  # Characters of a value in a message.


def describe_error(error: RcilabError) -> Message | LiteralText:
    """Returns the message for an error; without a code its English text."""
    reason = _describe_reason(error)
    if isinstance(error, InvalidValueError) and error.code in _REQUIREMENTS:
        value = str(error.value)
        shown = value if len(value) <= _MAX_SHOWN else value[: _MAX_SHOWN - 1] + "…"
        return message("value.unfit", name=error.name, value="" if error.value is None else shown, reason=reason)
    return reason


def describe_note(note: str) -> Message | LiteralText:
    """Returns the message for a note of a planner or a controller; without a code its English text."""
    if not (isinstance(note, Remark) and note.code):
        return LiteralText(note)
    if len(note.parts) != 1:
        parts = [describe_note(part) for part in note.parts] or [LiteralText(note)]
        return reduce(_join, reversed(parts))
    facts: dict[str, Any] = {
        name: describe_note(fact) if isinstance(fact, Remark) else fact for name, fact in note.facts.items()
    }
    if "unit" in facts:
        value, unit = float(facts["value"]), str(facts.pop("unit"))
        bound = float(facts.get("bound", value))  # Without a bound the message has the value alone.
        facts |= {"value": ComparedValue(value, bound, unit), "bound": ComparedValue(bound, value, unit)}
    return message(f"remark.{note.code}", **_with_names(facts))


def _join(second: Message | LiteralText, first: Message | LiteralText) -> Message | LiteralText:
    return message("remark.both", first=first, second=second)


def _describe_reason(error: RcilabError, scope: str = "error") -> Message | LiteralText:
    if not error.code:
        return LiteralText(str(error))
    inner = _SCOPES.get(error.code, scope)
    facts = {
        name: _describe_reason(fact, inner) if isinstance(fact, RcilabError) else fact
        for name, fact in error.facts.items()
    }
    return message(
        f"{scope if error.code in _WITH_ADVICE else 'error'}.{error.code}", **_with_names(_with_digits(facts))
    )


def _with_digits(facts: Mapping[str, Any]) -> dict[str, Any]:
    """Returns the facts, with the angle of a joint in the digits that show on which side of its bound it is."""
    if "angle" not in facts or not {"low", "high"} <= facts.keys():
        return dict(facts)
    bounds = (facts["limit"],) if "limit" in facts else (facts["low"], facts["high"])
    nearest = min(bounds, key=lambda bound: abs(bound - facts["angle"]))
    return {**facts, "angle": ComparedValue(facts["angle"], nearest, "rad")}


def _with_names(facts: Mapping[str, object]) -> dict[str, object]:
    """Returns the facts, with those in `_NAMES` replaced by messages."""
    names = {name: message(f"{name}.{str(facts[name]).replace(' ', '_')}") for name in _NAMES & facts.keys()}
    pairs = {name: _describe_pair(fact) for name, fact in facts.items() if isinstance(fact, LinkPair)}
    return {**facts, **names, **pairs}


def _describe_pair(pair: LinkPair) -> Message:
    first, second, obstacle = pair
    return message("pair", first=_describe_link(first), second=obstacle or _describe_link(second))


def _describe_link(number: int) -> Message:
    name = link_name(number)
    return message("pair.link", number=number) if number > 0 else message(f"pair.{name}")
