"""An empty page of viser's own: what to measure beside, and to measure parts of ours on."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from rcilab.views.gate import Gate
from rcilab.views.guarded_server import GuardedServer, listen

if TYPE_CHECKING:
    import viser


@contextmanager
def bare_page() -> Iterator[tuple[viser.ViserServer, str]]:
    """Serves an empty page on loopback; yields viser's server and the address."""
    bound = listen("127.0.0.1", 0)
    port = bound.getsockname()[1]
    with GuardedServer(bound, Gate(host="127.0.0.1", port=port)) as guard:
        yield guard.viser, f"http://127.0.0.1:{port}/"
