"""docs/realman.md keeps its promises: its two programs run as printed, and its links exist."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.peers.arena import Process

pytest.importorskip("Robotic_Arm", reason="needs the extra realman")

ROOT = Path(__file__).parents[3]
PAGE = (ROOT / "docs/realman.md").read_text(encoding="utf-8")
CLIENT, SESSION = re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL)


def run(code: str, home: Path) -> str:
    result = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, timeout=60, cwd=home, env={"HOME": str(home)}
    )
    assert result.returncode == 0, result.stderr
    return result.stdout


def test_the_program_with_the_client_library_moves_the_arm(tmp_path: Path) -> None:
    with Process("--host", "127.0.0.1", model="RM65") as process:
        output = run(CLIENT.replace('"127.0.0.2", 8080', f'"{process.host}", {process.port}'), tmp_path)
    assert "movej 0 at [0.0, -20.0, -70.0, 0.0, -80.0, 0.0] errors ['0']" in output


def test_the_session_plans_checks_and_moves(tmp_path: Path) -> None:
    found = re.fullmatch(r"moved for (\S+) s; home again within (\S+) rad\n", run(SESSION, tmp_path))
    assert found
    assert 0.3 < float(found[1]) < 3.0
    assert float(found[2]) < 2e-5


def test_its_links_exist() -> None:
    for target in re.findall(r"\]\(([^)#:]+)[^)]*\)", PAGE):
        assert (ROOT / "docs" / target).exists(), target
