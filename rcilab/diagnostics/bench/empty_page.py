"""An empty viser page: the reference, and the page on which single parts are measured."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rcilab.views.access_control import AccessPolicy
from rcilab.views.viser_server import GuardedServer, listen


@contextmanager
def bare_page() -> Iterator[tuple[Any, str]]:
    """Serves an empty page on loopback; yields the viser server and the address."""
    bound = listen("127.0.0.1", 0)
    port = bound.getsockname()[1]
    with GuardedServer(bound, AccessPolicy(host="127.0.0.1", port=port)) as guard:
        yield guard.viser, f"http://127.0.0.1:{port}/"
