"""What every test shares: fixed seeds, examples that a busy machine does not cut short, and one browser at a time."""

from __future__ import annotations

import os
from collections.abc import Iterator

import pytest
from hypothesis import HealthCheck, settings

settings.register_profile(
    "rcilab", derandomize=True, deadline=None, suppress_health_check=[HealthCheck.too_slow], database=None
)
settings.load_profile("rcilab")


LIVE = ("browser", "workbench", "supervisor")
"""In the names of files whose tests draw, or run control processes at 1 kHz: a core has no room for two of them."""


def is_live(file: str) -> bool:
    return any(name in file for name in LIVE)


@pytest.hookimpl(optionalhook=True)
def pytest_xdist_make_scheduler(config: pytest.Config, log: object) -> object:
    """Where tests run side by side (`pytest -n 3`), the live ones run at the end, one after the other."""
    from xdist.scheduler import LoadScopeScheduling

    class OneLiveTestAtATime(LoadScopeScheduling):
        """A file is a piece of work; all that are live are one."""

        def _split_scope(self, nodeid: str) -> str:
            file = super()._split_scope(nodeid)
            return "live" if is_live(file) else file

        def _assign_work_unit(self, node: object) -> None:
            if "live" in self.workqueue:  # They come last: what computes beside them would take the cores they need.
                self.workqueue.move_to_end("live")
            super()._assign_work_unit(node)

    return OneLiveTestAtATime(config, log)


@pytest.fixture(scope="session", autouse=True)
def _no_files_of_the_user(tmp_path_factory: pytest.TempPathFactory) -> Iterator[None]:
    """What a person has stored, such as poses, neither changes a test nor is changed by one."""
    with pytest.MonkeyPatch.context() as patch:
        for name in ("CONFIG", "STATE"):
            patch.setenv(f"XDG_{name}_HOME", os.fspath(tmp_path_factory.mktemp(name.lower())))
        yield
