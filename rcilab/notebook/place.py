"""Where the browser is, as far as the kernel can know: what decides whether a page of the kernel's can be framed.

The rule, first line that fits:

    1  Colab                                                            static: its frames reach no port of ours
    2  a hub, a server that listens beyond loopback, a server below a   proxy where jupyter-server-proxy is installed,
       path of its own (so something stands before it), or ssh          static where it is not
    3  VS Code with its kernel elsewhere (ssh, container, Codespaces)   static
    4  else the browser is on this machine                              loopback
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Literal

Way = Literal["loopback", "proxy", "static"]
_LOOPBACK = ("127.0.0.1", "localhost", "::1", "")


@dataclass(frozen=True, slots=True, kw_only=True)
class Place:
    """How a page that the kernel serves on loopback reaches the browser."""

    way: Way
    """loopback: by its own address; proxy: below the notebook server's; static: not at all."""
    base: str = "/"
    """Path of the notebook server, with slashes at both ends."""

    def address(self, url: str) -> str:
        """Returns where the browser finds a page of ours.

        Args:
            url: Its address on loopback, http://127.0.0.1:PORT/PATH.
        """
        if self.way != "proxy":
            return url
        port, _, path = url.removeprefix("http://").partition(":")[2].partition("/")
        return f"{self.base}proxy/{port}/{path}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Server:
    """The notebook server that started this kernel."""

    hostname: str
    base: str


def find_place(
    environment: Mapping[str, str] | None = None, server: Server | None = None, has_proxy: bool | None = None
) -> Place:
    """Returns how the browser of this notebook reaches the kernel, by the rule above.

    Args:
        environment: Of the kernel; its own when absent.
        server: What started it; looked up when absent.
        has_proxy: Whether jupyter-server-proxy is installed; looked up when absent.
    """
    known = os.environ if environment is None else environment
    if "COLAB_RELEASE_TAG" in known:
        return Place(way="static")
    found = _find_server(known) if server is None else server
    hub = known.get("JUPYTERHUB_SERVICE_PREFIX")
    base = hub or (found.base if found is not None else "/")
    is_code = any(name.startswith("VSCODE_") for name in known)
    is_far = "SSH_CONNECTION" in known
    if hub is not None or (found is not None and (found.hostname not in _LOOPBACK or base != "/" or is_far)):
        installed = find_spec("jupyter_server_proxy") is not None if has_proxy is None else has_proxy
        return Place(way="proxy" if installed else "static", base=base)
    if is_code and (is_far or "REMOTE_CONTAINERS" in known or "CODESPACES" in known):
        return Place(way="static")
    return Place(way="loopback")


def _find_server(environment: Mapping[str, str]) -> Server | None:
    """Returns the server whose child this kernel is; None where no server of this machine is it."""
    parent = environment.get("JPY_PARENT_PID", "")
    if "ipykernel" not in sys.modules or not parent.isdecimal():
        return None
    from jupyter_core.paths import jupyter_runtime_dir  # Asking jupyter_server itself would load it all: a second.

    try:
        told: Any = json.loads((Path(jupyter_runtime_dir()) / f"jpserver-{parent}.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):  # Another program is the parent, or it runs elsewhere.
        return None
    return Server(hostname=str(told.get("hostname", "")), base=str(told.get("base_url", "/")))
