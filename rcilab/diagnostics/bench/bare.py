"""An empty page of viser's own: the reference, and a place for parts of ours to be measured."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

from rcilab.views.access_control import AccessPolicy
from rcilab.views.viser_server import GuardedServer, listen


@contextmanager
def bare_page() -> Iterator[tuple[Any, str]]:
    """Serves an empty page on loopback; yields viser's server and the address."""
    bound = listen("127.0.0.1", 0)
    port = bound.getsockname()[1]
    with GuardedServer(bound, AccessPolicy(host="127.0.0.1", port=port)) as guard:
        yield guard.viser, f"http://127.0.0.1:{port}/"
