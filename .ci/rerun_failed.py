"""Runs alone what failed in a parallel run, and says by name what is broken and what is flaky.

`python .ci/rerun_failed.py FOLDER`: after a run of pytest with `-o cache_dir=FOLDER/parallel`. Every test that failed
is run alone twice, each time in a fresh pytest:

* it passes twice: flaky, reported; the exit code stays 0;
* it fails once more: flaky twice in a row on this commit (next to other tests and alone), exit code 1;
* it fails twice more: broken, exit code 1.

All of it happens on one commit in one run, so that a fresh clone needs no memory of earlier runs.
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

ROUNDS = 2
_ALL_PASSED, _SOME_FAILED = 0, 1  # pytest's exit codes; others mean that it could not test.


def read_failed(cache: Path) -> list[str]:
    """Returns the tests that failed in a run, without the groups that pytest-xdist appends (`test_a[x]@group`)."""
    file = cache / "v" / "cache" / "lastfailed"
    if not file.is_file():
        return []
    return sorted({strip_group(name) for name in json.loads(file.read_text(encoding="utf-8"))})


def strip_group(name: str) -> str:
    """Returns a test's id without its group."""
    at = name.find("@", name.rfind("]") + 1)  # Parameters may hold an @, and so may the group.
    return name if at < 0 else name[:at]


def run_alone(tests: list[str], folder: Path, number: int) -> list[str] | None:
    """Runs tests one after the other and returns those that failed, or None when pytest could not run them."""
    names, cache = folder / f"alone{number}.txt", folder / f"alone{number}"
    names.write_text("\n".join(tests) + "\n", encoding="utf-8")
    command = [sys.executable, "-m", "pytest", "-n", "0", "-o", f"cache_dir={cache}", f"@{names}"]
    code = subprocess.run(command, stdin=subprocess.DEVNULL, check=False).returncode
    return read_failed(cache) if code in (_ALL_PASSED, _SOME_FAILED) else None


def describe(tests: list[str], rounds: list[list[str]]) -> tuple[list[str], bool]:
    """Returns a line for each test that had failed, and whether all of them are merely flaky."""
    lines, is_fine = [], True
    for test in tests:
        failures = sum(test in failed for failed in rounds)
        if failures == 0:
            lines.append(f"ci: FLAKY, passes alone: {test}")
            continue
        is_fine = False
        kind = "BROKEN" if failures == len(rounds) else "FLAKY twice in a row on this commit"
        lines.append(f"ci: {kind}: {test}")
    return lines, is_fine


def main(folder: Path) -> int:
    """Returns the exit code."""
    tests = read_failed(folder / "parallel")
    if not tests:
        print("ci: pytest failed without a failed test", flush=True)
        return 1
    rounds: list[list[str]] = []
    for number in range(ROUNDS):
        failed = run_alone(tests, folder, number)
        if failed is None:
            print("ci: pytest could not run alone what had failed", flush=True)
            return 1
        rounds.append(failed)
    lines, is_fine = describe(tests, rounds)
    print("\n".join(lines), flush=True)
    return 0 if is_fine else 1


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1])))
