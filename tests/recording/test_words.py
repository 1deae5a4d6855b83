"""The words of the exported page are complete in both languages."""

from __future__ import annotations

from rcilab.i18n.catalogue import load_catalogue
from rcilab.i18n.locale import LANGUAGES
from tests.catalogues import require_equal


def test_every_language_has_the_same_keys_and_places_to_fill():
    require_equal(lambda language: load_catalogue("rcilab.recording", language), LANGUAGES)
