"""Errors in the words of faces: every code has words in both languages, and they survive the way between processes."""

from __future__ import annotations

import ast
import json
import math
import pickle
from collections.abc import Iterator
from pathlib import Path
from string import Formatter

import numpy as np
import pytest

import rcilab
from rcilab.app.text import Text as PageText
from rcilab.control_process.messages import as_sendable
from rcilab.core.errors import CommandRejectedError, PlanningError, RcilabError, UnreachableError, UsageError
from rcilab.i18n.catalogue import MAKERS, load_catalogue, merge_catalogues
from rcilab.i18n.error_messages import _WITH_ADVICE, describe_error, describe_note
from rcilab.i18n.locale import LANGUAGES
from rcilab.i18n.translator import LiteralText, Message, Remark, Text
from rcilab.makers.rokae.wire import GuideStatus, RecoveryStatus, SettingStatus, StartStatus, StopStatus


def coded() -> Iterator[tuple[str, set[str | None]]]:
    """Every code in the source, with the names of the facts it is given; None among them stands for others."""
    for path in sorted(Path(rcilab.__file__).parent.rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            is_call = isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "coded"
            if is_call and node.args and isinstance(code := node.args[0], ast.Constant) and code.value:
                yield str(code.value), {keyword.arg for keyword in node.keywords}


def places(entry: str) -> set[str]:
    return {name for _, name, _, _ in Formatter().parse(entry) if name}


def test_every_code_has_words_and_whatever_fills_them():
    used = list(coded())
    assert len(used) > 70
    for language in LANGUAGES:
        words = merge_catalogues(("rcilab.i18n", *MAKERS), language)
        known = {key.removeprefix("error.") for key in words if key.startswith("error.")}
        known -= {code for code in known if "." in code}  # The wording of a maker.
        assert {code for code, _ in used} == known
        for code, facts in used:
            assert None in facts or places(words[f"error.{code}"]) <= facts, code


def test_what_a_waypoint_asks_for_is_not_said_of_a_target():
    reason = UnreachableError("out of reach", distance=0.02).coded("too_far", distance=0.02)
    place = "900, 0, 300"
    for language, target, waypoint in (("en", "target", "waypoint"), ("zh", "目标", "路点")):
        text = Text(language, "rcilab.app")
        said = {"": text.render(describe_error(reason))}
        for code, facts in (("waypoint", {}), ("way", {"place": place}), ("blend", {"place": place})):
            error = PlanningError("waypoint 2").coded(code, number=2, kind="line", reason=reason, **facts)
            said[code] = text.render(describe_error(error))
        assert target in said[""]
        assert all(waypoint in said[code] and target not in said[code] for code in ("waypoint", "way", "blend"))


@pytest.mark.parametrize("about", ["waypoint_error", "way_error"])
def test_all_that_advises_has_its_words_for_programs_too(about):
    for language in LANGUAGES:
        words = load_catalogue("rcilab.i18n", language)
        found = {key.removeprefix(f"{about}.") for key in words if key.startswith(f"{about}.")}
        assert found == _WITH_ADVICE
        for code in found:
            assert places(words[f"{about}.{code}"]) == places(words[f"error.{code}"])


@pytest.mark.parametrize("kind", [SettingStatus, StartStatus, StopStatus, RecoveryStatus, GuideStatus])
def test_every_refusal_has_words(kind):
    words = load_catalogue("rcilab.i18n", "zh")
    for status in kind:
        if status:
            said = describe_error(CommandRejectedError("StartMove", status))
            assert isinstance(said, Message)
            assert isinstance(status_said := said.values["status"], Message)
            assert status_said.code in words


def test_the_english_sentence_stays_and_facts_come_along():
    inner = UsageError("the arm is moving").coded("moving")
    error = PlanningError("waypoint 2: the arm is moving", waypoint=2).coded(
        "waypoint", number=2, kind="line", reason=inner
    )
    assert str(error) == "waypoint 2: the arm is moving"
    for same in (error, pickle.loads(pickle.dumps(as_sendable(error))), pickle.loads(pickle.dumps(error))):
        said = describe_error(same)
        assert isinstance(said, Message)
        assert (said.code, said.values["number"]) == ("error.waypoint", 2)
        assert said.values["reason"] == describe_error(inner)
        assert Text("zh", "rcilab.i18n").render(said) == "路点 2（MoveL）：机械臂正在运动：请先停止，或等待到达"
    assert describe_error(RcilabError("nobody named this")) == LiteralText("nobody named this")


def test_an_angle_has_the_digits_that_show_that_it_is_beyond_its_limit():
    low, high = np.radians([-170.0, 170.0]).tolist()
    for angle, shown in ((170.0004, "170.0004°"), (171.25, "171.2°"), (-170.03, "-170.03°")):
        error = PlanningError("").coded("path_limit", joint=1, angle=math.radians(angle), low=low, high=high)
        said = PageText("en").render(describe_error(error))
        assert said.startswith(f"joint 1 would exceed its limit, at {shown} (allowed: -170° to 170°)")


def test_a_note_keeps_its_words_in_a_file_of_its_own():
    note = Remark("line 2: blend shortened", "blend", number=2, asked=0.05, radius=0.01)
    back = pickle.loads(pickle.dumps(note))
    said = describe_note(back)
    assert isinstance(said, Message)
    assert said.values["radius"] == pytest.approx(0.01)
    assert set(said.values) == {
        name for _, name, _, _ in Formatter().parse(load_catalogue("rcilab.i18n", "en")[said.code]) if name
    }
    assert describe_note("plain") == LiteralText("plain")


def test_many_remarks_in_one_line_grow_with_their_number_and_are_said_in_every_language():
    single = [Remark(f"{n} cycles in a row had no command", "lost_in_row", count=n) for n in range(1, 41)]
    whole = Remark.all([Remark.all(single[:20]), *single[20:], "and so on"])
    assert str(whole) == "; ".join([*map(str, single), "and so on"])
    size = [len(json.dumps(Remark.all(single[:count]).as_dict())) for count in (10, 20, 40)]
    assert size[2] < 2.2 * size[1] < 5.0 * size[0]
    back = Remark.from_dict(json.loads(json.dumps(whole.as_dict())))
    assert back == whole
    assert back.parts == whole.parts
    for language in ("en", "zh"):
        said = Text(language, "rcilab.i18n").render(describe_note(whole))
        assert said.count("40") == 1
        assert said.endswith("and so on")
    assert Remark.all([]) == ""
    assert Remark.all(single[:1]) is single[0]
