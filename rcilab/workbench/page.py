"""Our page out of viser's: the bar with status and Stop, the Esc key, the time cursor in the plots."""

from __future__ import annotations

from importlib.resources import files


def decorate(index: bytes) -> bytes:
    """Returns viser's `index.html` with our style sheet and script in its head.

    The bar must be there in every tab and with every panel folded away, and the Esc key must work while a text field
    has the focus; viser's own controls and hotkeys can do neither.
    """
    assets = files("rcilab.workbench") / "assets"
    style = (assets / "page.css").read_bytes()
    script = b"\n".join((assets / name).read_bytes() for name in ("page.js", "rows.js", "pick.js"))
    head = b"<style>" + style + b"</style><script>" + script + b"</script></head>"
    page = index.replace(b"<title>Viser</title>", b"<title>rcilab workbench</title>", 1)
    return page.replace(b"</head>", head, 1)
