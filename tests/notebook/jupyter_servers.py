"""A notebook server of Jupyter's in a folder of its own, as it writes about itself."""

from __future__ import annotations

import json
import os
import socket
import subprocess
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from tests.waiting import wait_for


@contextmanager
def serving(command: Sequence[str], folder: Path) -> Iterator[dict[str, Any]]:
    """Runs a command that becomes a server, with nothing of the user's, and ends it.

    Args:
        command: What to run.
        folder: Where it keeps its settings, and its "runtime".

    Yields:
        What it has written about itself, once it listens.
    """
    command = [*command, "--no-browser", *(["--allow-root"] if os.geteuid() == 0 else [])]
    environment = {**os.environ, "JUPYTERLAB_SETTINGS_DIR": str(folder / "settings")}
    environment |= {f"JUPYTER_{name}_DIR": str(folder / name.lower()) for name in ("CONFIG", "DATA", "RUNTIME")}
    with open(folder / "log", "w", encoding="utf-8") as log:
        process = subprocess.Popen(command, env=environment, stdout=log, stderr=log)

    def told() -> dict[str, Any] | None:
        assert process.poll() is None, (folder / "log").read_text(encoding="utf-8")
        for file in (folder / "runtime").glob("jpserver-*.json"):
            text = file.read_text(encoding="utf-8")
            if text.strip().endswith("}") and _listens(server := json.loads(text)):
                return server
        return None

    try:
        server = wait_for(told, 60.0, f"the server, which logs into {folder},")
        assert server is not None
        yield server
    finally:
        process.terminate()
        process.wait(15)


def _listens(server: dict[str, Any]) -> bool:
    """Returns whether it can be asked already: it writes about itself a moment before."""
    try:
        socket.create_connection((server["hostname"], server["port"]), timeout=5.0).close()
    except ConnectionRefusedError:
        return False
    return True
