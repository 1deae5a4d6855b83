"""The style of the parts, in light and dark notebooks: one style sheet and a few common HTML elements."""

from __future__ import annotations

import html
from functools import lru_cache
from importlib.resources import files
from typing import Any, Literal

import ipywidgets

from rcilab.i18n.translator import Message, Text, with_space
from rcilab.notebook.widget_sharing import cached_widget, is_shared, shared_style_widget

Tone = Literal["good", "warn", "bad", "none"]

PHASE_TONES: dict[str, Tone] = {
    "idle": "good",
    "moving": "good",
    "stopping": "warn",
    "starting": "warn",
    "connecting": "warn",
}
"""Phases of a robot that is ready or starting; all others are bad."""

esc = html.escape


@lru_cache
def _sheet() -> str:
    return (files("rcilab.notebook") / "assets" / "lab.css").read_text(encoding="utf-8")


def style_sheet() -> Any:
    """Returns the widget with the style sheet, one for all parts; it is invisible."""
    return cached_widget(
        "sheet", lambda: shared_style_widget(ipywidgets.HTML, f"<style>{_sheet()}</style>", layout={"display": "none"})
    )


def block(content: str = "", **layout: str) -> Any:
    """Returns a widget that shows HTML."""
    return shared_style_widget(ipywidgets.HTML, f'<div class="rl">{content}</div>' if content else "", layout=layout)


def write(widget: Any, content: str) -> None:
    """Shows other HTML, if it differs."""
    wrapped = f'<div class="rl">{content}</div>' if content else ""
    if widget.value != wrapped:
        widget.value = wrapped


def verdict(tone: Tone, word: str, rest: str) -> str:
    """Returns a line with a coloured edge: the verdict in one word, and the sentence."""
    lead, follows = with_space(word, rest)
    return f'<p class="rl-verdict rl-{tone}" role="status"><b>{esc(lead)}</b>{esc(follows)}</p>'


def soft(text: str) -> str:
    """Returns a line in a muted colour."""
    return f'<p class="rl-soft">{esc(text)}</p>'


def why_html(text: Text, why: Message | None) -> str:
    """Returns why a control is disabled; empty for None."""
    return "" if why is None else soft(text.render(why))


def problem(text: str) -> str:
    """Returns the problem of a typed value."""
    return f'<p class="rl-problem" role="alert">{esc(text)}</p>' if text else ""


def head(text: str) -> str:
    """Returns the heading of a group of controls."""
    return f'<p class="rl-head">{esc(text)}</p>'


def table(heads: list[str], rows: list[list[str]], *, right: bool = False) -> str:
    """Returns a table of plain text."""
    top = "".join(f"<th>{esc(cell)}</th>" for cell in heads)
    body = "".join("<tr>" + "".join(f"<td>{esc(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    return f'<table class="{"rl-right" if right else ""}"><tr>{top}</tr>{body}</table>'


def close_tree(widget: Any) -> None:
    """Closes a widget with all its children; ipywidgets keeps open ones as long as the kernel runs."""
    for child in getattr(widget, "children", ()):
        close_tree(child)
    for name in ("layout", "style"):
        part = getattr(widget, name, None)
        if isinstance(part, ipywidgets.Widget) and not is_shared(part):
            part.close()
    if not is_shared(widget):
        widget.close()
