"""JupyterLab with the lessons, on this machine only: it makes no network requests and shows no pop-ups."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from hashlib import sha256
from pathlib import Path

from rcilab.core.errors import UsageError
from rcilab.core.optional_deps import require_installed
from rcilab.notebook.lessons import INDEX

_CONFIG_PATH = "JUPYTER_CONFIG_PATH"


def lab_command(
    directory: Path, *, port: int | None = None, browser: bool = True, allow_root: bool = False
) -> list[str]:
    """Returns the command that opens JupyterLab on a directory, listening on loopback only.

    Args:
        directory: Directory of the notebooks.
        port: TCP port; None takes Jupyter's default, 8888 or the next free one.
        browser: Whether to open a browser.
        allow_root: Whether root may run it, as in a container; Jupyter refuses otherwise.

    A directory with a page `index.md` is opened on that page.

    Raises:
        UsageError: JupyterLab is not installed, there is no such directory, or root needs `allow_root`.
    """
    require_lab(allow_root=allow_root)
    if not os.path.isdir(directory):
        raise UsageError(f"there is no directory {directory}: name one that holds notebooks")
    command = [sys.executable, "-m", "jupyterlab", str(directory), "--ServerApp.ip=127.0.0.1"]
    command.append("--LabApp.extension_manager=readonly")  # The default one queries PyPI.
    if (directory / INDEX).is_file():
        command.append(f"--LabApp.default_url=/lab/tree/{INDEX}")  # Our settings open it as a page, not as its source.
    command.append(f"--LabApp.workspaces_dir={_workspaces(directory)}")
    if port is not None:
        command += [f"--ServerApp.port={port}", "--ServerApp.port_retries=0"]
    if not browser:
        command.append("--no-browser")
    if allow_root:
        command.append("--allow-root")
    return command


def _workspaces(directory: Path) -> Path:
    """Returns the workspace of a directory; a shared one would show its tabs in every other directory."""
    from jupyter_core.paths import jupyter_config_dir

    digest = sha256(str(directory.resolve()).encode()).hexdigest()[:8]
    return Path(jupyter_config_dir()) / "lab" / "workspaces" / f"rcilab-{digest}"


def require_lab(*, allow_root: bool = False) -> None:
    """Checks that JupyterLab can be started.

    Args:
        allow_root: See `lab_command`.

    Raises:
        UsageError: It is not installed, or root needs `allow_root`.
    """
    require_installed("jupyterlab", "the lab")
    if os.geteuid() == 0 and not allow_root:
        raise UsageError("you are root, and JupyterLab refuses root by default: add --allow-root")


def lab_environment(environment: Mapping[str, str]) -> dict[str, str]:
    """Returns the environment of JupyterLab: our defaults below the user's own settings.

    Without our defaults it asks at the first start whether it may fetch news.

    Args:
        environment: Environment of this process.
    """
    ours = str(Path(__file__).parent / "assets" / "jupyter")
    others = environment.get(_CONFIG_PATH)
    return {**environment, _CONFIG_PATH: ours if not others else f"{others}{os.pathsep}{ours}"}


def open_lab(command: list[str]) -> int:
    """Replaces this process by JupyterLab, so that Ctrl-C reaches it and no process is left."""
    sys.stdout.flush()
    os.execve(command[0], command, lab_environment(os.environ))
