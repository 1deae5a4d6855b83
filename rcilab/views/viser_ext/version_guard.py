"""The versions of viser whose internals this package knows: one check for every patch in it."""

from __future__ import annotations

from rcilab.core.errors import UsageError

KNOWN = "1.1."


def require_known_viser() -> None:
    """Refuses a viser whose internals may differ from those that are replaced here.

    Raises:
        UsageError: Another version is installed.
    """
    import viser

    if not viser.__version__.startswith(KNOWN):
        raise UsageError(f"viser {viser.__version__} is installed, but rcilab needs viser {KNOWN}x: install that one")
