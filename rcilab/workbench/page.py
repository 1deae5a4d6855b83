"""The page, made from viser's: the bar with status and Stop, the Esc key, the time cursor in the plots."""

from __future__ import annotations

import json
from importlib.resources import files
from typing import TYPE_CHECKING

from rcilab.views.viser_ext.client_messages import run_javascript

if TYPE_CHECKING:
    import viser

    from rcilab.views.viser_ext.control_list import Control

_BRAND = (11, 111, 194)


def decorate(index: bytes, quality: str = "full") -> bytes:
    """Returns viser's `index.html` with our style sheet and script in its head.

    The bar must be visible in every tab and with every panel folded, and the Esc key must work while a text field has
    the focus; viser's own controls and hotkeys cannot do either.

    Args:
        index: The page of viser.
        quality: Quality of the scene: "light" has no smoothed edges, which a browser cannot change later.
    """
    assets = files("rcilab.workbench") / "assets"
    style = (assets / "page.css").read_bytes()
    scripts = (
        "heartbeat",
        "page",
        "marks",
        "names",
        "rows",
        "pick",
        "branches",
        "folds",
        "resend",
        "labels",
        "toolbar",
        "scene3d",
        "handles",
        "legend",
        "touch",
        "measure",
        "capture",
        "jog_devices",
        "draw",
        "palette",
        "history",
        "link",
    )
    script = b"\n".join((assets / f"{name}.js").read_bytes() for name in scripts)
    head = b"<style>" + style + b"</style><script>" + script + b"</script></head>"
    page = index.replace(b"<title>Viser</title>", b"<title>rcilab workbench</title>", 1)
    page = page.replace(b"<html ", f'<html data-rl-quality="{quality}" '.encode(), 1)
    return page.replace(b"</head>", head, 1)


def introduce(client: viser.ClientHandle, key: str) -> None:
    """Informs a page of its client id, and of the key that proves it on its live connection."""
    call = f"window.rcilabPage?.({client.client_id}, {json.dumps(key)});"
    run_javascript(client, call)


def send_commands(client: viser.ClientHandle, controls: list[Control]) -> None:
    """Sends a page the list for its command palette."""
    facts = [
        {
            "id": one.uuid,
            "name": one.label,
            "hint": one.hint,
            "place": one.place,
            "off": one.is_disabled,
            "options": one.options,
        }
        for one in controls
    ]
    run_javascript(client, f"window.rcilabCommands?.({json.dumps(facts)});")


def send_link(client: viser.ClientHandle, link: str, said: str, tone: str) -> None:
    """Makes a page copy a link to itself, and say so.

    Args:
        client: The page.
        link: Text of the link; "" copies nothing.
        said: What the page says then.
        tone: Tone of that.
    """
    run_javascript(client, f"window.rcilabLink?.({json.dumps({'link': link, 'text': said, 'tone': tone})});")


def dress(server: viser.ViserServer, theme: str) -> None:
    """Sets the page's colours, light or dark."""
    server.gui.configure_theme(
        brand_color=_BRAND, show_logo=False, show_share_button=False, control_width="medium", dark_mode=theme == "dark"
    )
