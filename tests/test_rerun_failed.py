"""What CI says about a test that failed in the parallel run, by how it does alone."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

SCRIPT = Path(__file__).parents[1] / ".ci" / "rerun_failed.py"
TESTS = """
import os
from pathlib import Path
import pytest

IS_PARALLEL = "PYTEST_XDIST_WORKER" in os.environ

def test_fine():
    pass

@pytest.mark.xdist_group("a@b")
@pytest.mark.parametrize("name", ["a b", "x@y"])
def test_flaky(name):
    assert not IS_PARALLEL

if {broken}:
    def test_broken():
        assert False

    def test_flaky_twice():
        seen = Path("seen")
        is_second_time_alone = seen.exists()
        if not IS_PARALLEL:
            seen.touch()
        assert is_second_time_alone
"""


def rerun(folder: Path, *, broken: bool) -> tuple[int, list[str]]:
    """Returns the exit code and what is reported of a suite that is run in parallel first."""
    (folder / "test_some.py").write_text(TESTS.format(broken=broken))
    (folder / "pytest.ini").write_text("[pytest]\n")
    environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTEST_")}
    command = [sys.executable, "-m", "pytest", "-n", "1", "--dist", "loadgroup", "-o", f"cache_dir={folder}/parallel"]
    assert subprocess.run(command, cwd=folder, env=environment, capture_output=True, check=False).returncode == 1
    failed = json.loads((folder / "parallel" / "v" / "cache" / "lastfailed").read_text())
    assert "test_some.py::test_flaky[x@y]@a@b" in failed, "pytest-xdist does not group tests with this pytest"
    done = subprocess.run(
        [sys.executable, str(SCRIPT), str(folder)],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        check=False,
    )
    return done.returncode, [line for line in done.stdout.splitlines() if line.startswith("ci: ")]


def test_what_passes_alone_twice_is_reported_as_flaky_and_passes(tmp_path):
    code, lines = rerun(tmp_path, broken=False)
    assert code == 0
    assert lines == [f"ci: FLAKY, passes alone: test_some.py::test_flaky[{name}]" for name in ("a b", "x@y")]


def test_what_fails_alone_once_or_twice_fails(tmp_path):
    code, lines = rerun(tmp_path, broken=True)
    assert code == 1
    assert lines == [
        "ci: BROKEN: test_some.py::test_broken",
        "ci: FLAKY, passes alone: test_some.py::test_flaky[a b]",
        "ci: FLAKY, passes alone: test_some.py::test_flaky[x@y]",
        "ci: FLAKY twice in a row on this commit: test_some.py::test_flaky_twice",
    ]
