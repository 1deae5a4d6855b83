"""The catalogues are complete gettext files: a key once, both languages filled, the same variables in both."""

from __future__ import annotations

from pathlib import Path

import pytest
from babel.messages.pofile import read_po

import rcilab
from tests.catalogues import fields

ROOT = Path(rcilab.__file__).parent
FILES = sorted(ROOT.rglob("catalogues/*.po"))


def test_every_folder_of_catalogues_holds_one_gettext_file():
    assert len(FILES) >= 7
    assert {path.name for path in ROOT.rglob("catalogues/*")} == {"zh.po"}


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
