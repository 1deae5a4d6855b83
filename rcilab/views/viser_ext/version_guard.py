"""The supported versions of viser, checked once for all patches in this package."""

from __future__ import annotations

from rcilab.core.errors import UsageError

KNOWN = "1.1."


def require_known_viser() -> None:
    """Raises an error for a viser version whose internals may differ from those that are patched here.

    Raises:
        UsageError: Another version is installed.
    """
    import viser

    if not viser.__version__.startswith(KNOWN):
        raise UsageError(
            f"viser {viser.__version__} is installed, but rcilab needs viser {KNOWN}x: install that version"
        )
