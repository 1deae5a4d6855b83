from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
import time
import urllib.request
from pathlib import Path
from typing import Any

import pytest

from rcilab.errors import UsageError
from rcilab.notebook.lab import find_notebooks, lab_command


def test_the_lessons_are_found() -> None:
    assert (find_notebooks() / "01_first_motion.ipynb").is_file()


def test_a_missing_directory_is_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="no-such-place"):
        lab_command(tmp_path / "no-such-place")


def test_jupyterlab_starts_on_loopback_and_serves_the_directory(tmp_path: Path) -> None:
    (tmp_path / "notes").mkdir()
    runtime = tmp_path / "runtime"
    command = [sys.executable, "-m", "rcilab.cli", "lab"]
    command += [str(tmp_path / "notes"), "--no-browser", *(["--allow-root"] if os.geteuid() == 0 else [])]
    environment = {
        **os.environ,
        "JUPYTER_RUNTIME_DIR": str(runtime),
        "JUPYTER_CONFIG_DIR": str(tmp_path / "config"),
        "JUPYTER_DATA_DIR": str(tmp_path / "data"),
    }
    with open(tmp_path / "log", "w", encoding="utf-8") as log:
        lab = subprocess.Popen(command, env=environment, stdout=log, stderr=log)
    try:
        server = _wait_for_server(runtime, lab, tmp_path / "log")
        assert server["hostname"] == "127.0.0.1"
        assert Path(server["root_dir"]) == tmp_path / "notes"
        with urllib.request.urlopen(f"{server['url']}lab?token={server['token']}", timeout=10) as page:
            assert b"JupyterLab" in page.read()
    finally:
        lab.terminate()
        lab.wait(10)


def _wait_for_server(runtime: Path, lab: subprocess.Popen[bytes], log: Path) -> dict[str, Any]:
    """Returns what Jupyter writes about itself, once it listens: it writes a moment before that."""
    deadline = time.monotonic() + 40.0
    while time.monotonic() < deadline:
        assert lab.poll() is None, log.read_text(encoding="utf-8")
        for file in runtime.glob("jpserver-*.json"):
            text = file.read_text(encoding="utf-8")
            if text.strip().endswith("}") and _listens(server := json.loads(text)):
                return server
        time.sleep(0.1)
    raise AssertionError("JupyterLab did not start within 40 s:\n" + log.read_text(encoding="utf-8"))


def _listens(server: dict[str, Any]) -> bool:
    try:
        socket.create_connection((server["hostname"], server["port"]), timeout=5.0).close()
    except ConnectionRefusedError:
        return False
    return True
