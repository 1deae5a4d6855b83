"""The catalogues are complete, agree with each other and with the code that uses them."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import rcilab
from rcilab.app.status_text import describe_remedy
from rcilab.app.text import Text
from rcilab.app.view_actions import QUALITIES
from rcilab.control_process.status import PHASES
from rcilab.core.errors import InvalidValueError
from rcilab.core.state import ControllerMode, RobotMode
from rcilab.i18n.catalogue import load_catalogue as load_room_catalogue
from rcilab.i18n.catalogue import load_ui_catalogue
from rcilab.i18n.locale import LANGUAGES
from rcilab.i18n.translator import message
from rcilab.makers.maker import all_makers
from rcilab.model.robot_model import load_model
from rcilab.motion.joint import JOINT_LAWS
from tests.catalogues import require_equal

_ROOT = Path(rcilab.__file__).parent
SOURCES = sorted(path for part in ("app", "workbench") for path in (_ROOT / part).rglob("*.py"))


def test_every_language_has_the_same_keys_and_places_to_fill():
    require_equal(lambda language: load_ui_catalogue("rcilab.app", language), LANGUAGES)


@pytest.mark.parametrize("language", LANGUAGES)
def test_no_text_of_the_page_has_the_marks_of_a_terminal(language: str):
    assert [key for key, entry in load_ui_catalogue("rcilab.app", language).items() if "`" in entry] == []


def test_no_key_of_the_page_is_also_a_shared_one():
    own, shared = (load_room_catalogue(package, "en").keys() for package in ("rcilab.app", "rcilab.i18n"))
    assert not own & shared, "said twice: page and shared"


def test_every_key_written_in_the_code_exists():
    known = load_ui_catalogue("rcilab.app", "en")
    written = {
        key
        for path in SOURCES
        for key in re.findall(r"""(?:\btext|_text|message)\(\s*["']([a-z_.]+)["']""", path.read_text())
        if not key.endswith(".")
    }
    assert len(written) > 60
    assert sorted(written - set(known)) == []


def test_every_name_that_becomes_a_key_has_one():
    known = set(load_ui_catalogue("rcilab.app", "en"))
    wanted = [f"condition.{row.id}" for maker in all_makers() for row in maker.conditions().conditions]
    wanted += [f"phase.{phase}" for phase in PHASES]
    wanted += [f"robot_mode.{mode.name}" for mode in RobotMode]
    wanted += [f"controller_mode.{mode.name}" for mode in ControllerMode]
    wanted += [f"law.{law}" for law in JOINT_LAWS] + [f"quality.{quality}" for quality in QUALITIES]
    wanted += [f"scheduling.{kind}" for kind in ("SCHED_FIFO", "normal")]
    wanted += [f"reach.tone.{tone}" for tone in ("good", "warn", "bad")]
    assert sorted(set(wanted) - known) == []


@pytest.mark.parametrize("maker", all_makers(), ids=lambda maker: maker.name)
def test_the_texts_of_a_makers_faults_are_those_of_its_fault_table(maker):
    text = Text("en")
    for fault in maker.faults():
        assert text(f"fault.{fault.key}") == fault.cause
        assert describe_remedy(fault, text).removeprefix(text("run.remedy")).strip() == fault.remedy
    for scenario in (found for name in maker.robots for found in maker.scenarios(load_model(name))):
        for what in ("label", "sent", "explanation", "prevention"):
            assert text.has(f"{what}.{scenario.fault.key}")


def test_the_room_of_a_maker_is_the_only_one_that_names_its_faults():
    keys = {
        key
        for package in ("rcilab.app", "rcilab.i18n", "rcilab.notebook")
        for key in load_room_catalogue(package, "en")
    }
    names = {fault.name for maker in all_makers() for fault in maker.faults()}
    assert not {key for key in keys if key.rpartition(".")[2] in names}


def test_messages_inside_messages_are_translated_too():
    said = Text("zh").render(message("notice.refused", what=message("drive.execute"), error="x"))
    assert said == "执行未成功：x。"


def test_an_unknown_language_lists_the_known_ones():
    with pytest.raises(InvalidValueError, match="en, zh"):
        Text("fr")
