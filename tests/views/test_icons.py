"""The buttons' icons are viser's own, and its archive is opened once."""

from __future__ import annotations

from io import BytesIO
from string import ascii_uppercase
from zipfile import ZipFile

import pytest

from rcilab.views.viser_ext import icons


@pytest.mark.parametrize("name", ["player-play", "x", "arrow-back-up", "hand-finger"])
def test_an_icon_is_the_one_that_viser_reads(name: str) -> None:
    from viser._icons import svg_from_icon

    assert icons.svg_of(name) == svg_from_icon.__wrapped__(name)


def test_an_icon_that_does_not_exist_is_an_error() -> None:
    with pytest.raises(KeyError, match="no-such-icon"):
        icons.svg_of("no-such-icon")


def test_a_page_of_more_icons_than_viser_remembers_opens_the_archive_once(monkeypatch: pytest.MonkeyPatch) -> None:
    import viser

    opened: list[BytesIO] = []

    def counted(file: BytesIO) -> ZipFile:
        opened.append(file)
        return ZipFile(file)

    monkeypatch.setattr(icons, "ZipFile", counted)
    icons.install()
    icons.svg_of.cache_clear()
    icons._archive.cache_clear()
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    try:
        kinds = ("LETTER", "CIRCLE_LETTER")
        names = [getattr(viser.Icon, f"{kind}_{letter}") for kind in kinds for letter in ascii_uppercase]
        buttons = [server.gui.add_button(name, icon=name) for name in names]
        buttons[0].icon = viser.Icon.X
    finally:
        server.stop()
    assert len(opened) == 1
    assert icons.svg_of.cache_info().currsize == len(names) + 1


def test_the_hint_of_a_button_lies_in_its_icon_and_in_no_other() -> None:
    import viser

    icons.install()
    icons.install()
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    try:
        hinted = server.gui.add_button("Go", icon="player-play", hint='so "far" & <on>')
        upload = server.gui.add_upload_button("Load", icon="upload", hint="a file")
        plain = server.gui.add_button("Stay", icon="player-play")
        html = [handle._impl.props._icon_html for handle in (hinted, upload, plain)]
        assert f'{icons.HINT}="so &quot;far&quot; &amp; &lt;on&gt;"' in html[0]
        assert html[0].count(icons.HINT) == html[1].count(icons.HINT) == 1
        assert f'{icons.HINT}="a file"' in html[1]
        assert html[2] == icons.svg_of("player-play")
    finally:
        server.stop()
