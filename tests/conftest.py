"""What every test shares: fixed seeds, examples that a busy machine does not cut short, and one browser at a time."""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, settings

settings.register_profile(
    "rcilab", derandomize=True, deadline=None, suppress_health_check=[HealthCheck.too_slow], database=None
)
settings.load_profile("rcilab")

# Containers like to switch bytecode off. Every worker, kernel and control process would compile the package anew.
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

# Whoever imports nbformat gets jsonschema, which then builds a grammar of international web addresses: 1.7 s of every
# worker, for a format that no notebook uses. jsonschema leaves it out where the library is missing.
sys.modules.setdefault("rfc3987_syntax", None)  # pyright: ignore[reportArgumentType]


LANES = {"pages": ("browser",), "loops": ("workbench", "supervisor")}
"""In the names of files whose tests draw, or run control processes at 1 kHz: a core has no room for two of a kind."""
_KINDS = {
    "notebook": ("notebook",),
    "waits": ("/gallery/", "test_faults_on_wire", "test_fuzz", "cli/test_run"),
    "long": ("/peers/", "test_vendor_programs", "client/test_motions", "test_still", "cli/test_bench", "test_readme"),
    "sums": ("/conformance/", "/dynamics/", "/kinematics/", "/motion/", "/posing/", "/protocols/", "/robots/"),
}
_ORDER = ("pages", "loops", "notebook", "waits", "long", "", "sums")
"""Pages take longest, and loops, which wait more than they compute, are what fits beside them. What only computes comes
in the smallest pieces and fills what is left, so what is long for the number of its tests goes before."""
_SPARE = ("waits", "sums")
"""What a worker more than there are cores begins with: it hardly is in anybody's way."""


def lane_of(file: str) -> str:
    """Returns the lane that a file's tests run in, one after the other; nothing for files that need none."""
    return _kind(file, LANES)


def place_of(scope: str) -> int:
    """Returns when a piece of work comes: places of `_ORDER`."""
    return _ORDER.index(scope if scope in LANES else _kind(scope, _KINDS))


def _kind(name: str, kinds: dict[str, tuple[str, ...]]) -> str:
    return next((kind for kind, parts in kinds.items() if any(part in name for part in parts)), "")


def is_spare(worker: str) -> bool:
    """Returns whether a worker is one more than there are cores."""
    return worker.startswith("gw") and int(worker[2:]) >= (os.cpu_count() or 1)


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """A spare worker takes no turn from pages and loops as long as it only computes."""
    if os.geteuid() == 0 and is_spare(os.environ.get("PYTEST_XDIST_WORKER", "")):  # Others could not go back.
        only_computes = _ORDER[place_of(item.nodeid.partition("::")[0])] == "sums"
        os.sched_setscheduler(0, os.SCHED_IDLE if only_computes else os.SCHED_OTHER, os.sched_param(0))


@pytest.hookimpl(tryfirst=True)
def pytest_collection(session: pytest.Session) -> None:
    """Where workers stand side by side, each loads its own part of the tests before it collects all of them.

    To compile a test's assertions takes longer than everything else in collecting it, and in a fresh clone nobody has
    done it yet: one after the other they would do the same work at the same time.
    """
    gc.disable()  # Until all are collected.
    worker = os.environ.get("PYTEST_XDIST_WORKER", "")
    if not worker.startswith("gw"):
        return
    count = int(os.environ["PYTEST_XDIST_WORKER_COUNT"])
    for path in sorted(Path(__file__).parent.rglob("test_*.py"))[int(worker[2:]) % count :: count]:
        with suppress(Exception):  # It is told where the tests are collected.
            pytest.Module.from_parent(session, path=path).obj  # noqa: B018


def pytest_collection_finish() -> None:
    """What collecting makes stays until the end: no garbage is looked for meanwhile, nor later among it."""
    gc.freeze()
    gc.enable()


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: object) -> object:
    """Where tests run side by side (`pytest -n 3`), a file is a piece of work, and so is a lane."""
    from xdist.scheduler import LoadScopeScheduling

    class InLanes(LoadScopeScheduling):
        def _split_scope(self, nodeid: str) -> str:
            file = super()._split_scope(nodeid)
            return lane_of(file) or file

        def _assign_work_unit(self, node: Any) -> None:
            spare = [scope for scope in self.workqueue if _ORDER[place_of(scope)] in _SPARE]
            if is_spare(node.gateway.id) and spare:
                first = min(spare, key=place_of)
            elif self._is_idle(node) and self._is_crowded():
                return  # Asked again after every test.
            else:
                first = min(self.workqueue, key=place_of)  # The first of those that come first.
            self.workqueue.move_to_end(first, last=False)
            super()._assign_work_unit(node)

        def mark_test_complete(self, node: object, item_index: int, duration: float = 0) -> None:
            super().mark_test_complete(node, item_index, duration)
            for other in filter(self._is_idle, self.nodes):
                self._reschedule(other)

        def _is_crowded(self) -> bool:
            """Returns whether pages are drawn and every core has a worker: a further one would only slow them down."""
            drawn = any(False in work.get("pages", {}).values() for work in self.assigned_work.values())
            busy = sum(not (self._is_idle(node) or is_spare(node.gateway.id)) for node in self.nodes)
            return drawn and busy >= (os.cpu_count() or 1)

        def _is_idle(self, node: object) -> bool:
            return not self._pending_of(self.assigned_work[node])

    return InLanes(config, log)


@pytest.fixture(scope="session", autouse=True)
def _no_files_of_the_user(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """What a person has stored, such as poses, neither changes a test nor is changed by one."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("IPYTHONDIR", os.fspath(tmp_path_factory.mktemp("ipython")))
        for name in ("CONFIG", "STATE"):
            patch.setenv(f"XDG_{name}_HOME", os.fspath(tmp_path_factory.mktemp(name.lower())))
        yield
