"""The catalogues are complete gettext files: a key once, both languages filled, the same variables in both."""

from __future__ import annotations

from pathlib import Path

import pytest
from babel.messages.pofile import read_po

import rcilab
from rcilab.i18n.catalogue import MAKERS, SHARED, load_catalogue, merge_catalogues
from rcilab.i18n.translator import Text
from tests.catalogues import fields

ROOT = Path(rcilab.__file__).parent
FILES = sorted(ROOT.rglob("catalogues/*.po"))


def test_every_folder_of_catalogues_holds_one_gettext_file():
    assert len(FILES) >= 7
    assert {path.name for path in ROOT.rglob("catalogues/*")} == {"zh.po"}


def test_the_wording_of_a_maker_takes_the_place_of_the_usual_one_and_fills_the_same():
    packages = ("rcilab.app", "rcilab.notebook", "rcilab.recording")
    usual = merge_catalogues((SHARED, *packages), "en")
    for maker in MAKERS:
        name = maker.rpartition(".")[2]
        for key, text in load_catalogue(maker, "en").items():
            if key.endswith(f".{name}") and key not in (f"manual.{name}", f"remedy.{name}"):
                assert fields(text) <= fields(usual[key.removesuffix(f".{name}")]), key
    assert Text("en", "rcilab.app", maker="franka")("safety.estop") == "User stop"
    assert Text("en", "rcilab.app")("safety.estop") == "Emergency stop"


@pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.parent.parent.relative_to(ROOT)))
def test_every_text_has_a_key_of_its_own_and_is_translated_with_its_variables(path):
    with path.open("rb") as file:
        catalog = read_po(file, locale="zh", abort_invalid=True)
    entries = [entry for entry in catalog if entry.id]
    keys = [line for line in path.read_text(encoding="utf-8").splitlines() if line.startswith("msgctxt ")]
    assert len(keys) == len(set(keys)) == len(entries)
    assert not catalog.obsolete
    for entry in entries:
        assert entry.context
        assert not entry.fuzzy, entry.context
        assert entry.string.strip(), entry.context
        assert fields(entry.string) == fields(entry.id), entry.context
