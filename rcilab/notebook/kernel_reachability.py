"""Whether the browser can show a page of the kernel in a frame, from what the kernel knows of where the browser runs.

The rule; the first line that applies counts:

    1  Colab                                                            static: its frames cannot reach the kernel
    2  VS Code in a browser (code-server), which names port addresses   proxy, at the address that it names
    3  VS Code with a kernel elsewhere: over ssh, in a container, ...,  static
       or of a notebook server as in 4, whose paths VS Code's page lacks
    4  a hub, a server that listens beyond loopback, a server below a   proxy where jupyter-server-proxy is installed,
       path other than / (so behind a proxy), or ssh                    static otherwise
    5  otherwise the browser is on this machine                         loopback

The front end is known from the running cell: VS Code's cells have a special address. If no cell runs, VS Code is
recognised by its environment variables (microsoft/vscode-jupyter passes its environment to its kernels).
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

from rcilab.i18n.notebook_language import shell

Route = Literal["loopback", "proxy", "static"]
_LOOPBACK = ("127.0.0.1", "localhost", "::1", "")
_CODE_CELL = "vscode-"  # Prefix of the addresses of its cells.
_CODE_SERVER = "CODE_SERVER_PARENT_PID"  # Other servers with port addresses need a login that VS Code's page lacks.
_CODE_PORTS, _PORT = "VSCODE_PROXY_URI", "{{port}}"
_CODE_REMOTE_SIGNS = ("SSH_CONNECTION", "REMOTE_CONTAINERS", "CODESPACES")
_CODE_REMOTE = "VSCODE_IPC_HOOK_CLI"  # Its kernels have it if VS Code's backend is that of a server.
_CODE_WSL = "WSL_DISTRO_NAME"  # Windows shares its loopback with that server.


@dataclass(frozen=True, slots=True, kw_only=True)
class KernelReachability:
    """How the browser reaches a page that the kernel serves on loopback."""

    route: Route
    """loopback: by its own address; proxy: through the notebook server; static: not at all."""
    base: str = "/"
    """Path of the notebook server, with slashes at both ends."""
    ports: str = ""
    """Address at which code-server serves the ports of its machine, with {{port}} for the number; empty without one."""
    proxy_helps: bool = True
    """Whether jupyter-server-proxy on the notebook server would turn static into live."""

    def address(self, url: str) -> str:
        """Returns the address of our page for the browser.

        Args:
            url: Its address on loopback, http://127.0.0.1:PORT/PATH.
        """
        if self.route != "proxy":
            return url
        port, _, path = url.removeprefix("http://").partition(":")[2].partition("/")
        if self.ports:
            return f"{self.ports.replace(_PORT, port).rstrip('/')}/{path}"
        return f"{self.base}proxy/{port}/{path}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Server:
    """The notebook server that started this kernel."""

    hostname: str
    base: str


def find_reachability(
    environment: Mapping[str, str] | None = None,
    server: Server | None = None,
    has_proxy: bool | None = None,
    cell: str | None = None,
) -> KernelReachability:
    """Returns how the browser of this notebook reaches the kernel, by the rule above.

    Args:
        environment: Environment of the kernel; defaults to that of this process.
        server: The server that started it; looked up by default.
        has_proxy: Whether jupyter-server-proxy is installed; looked up by default.
        cell: Id of the running cell; looked up by default.
    """
    known = os.environ if environment is None else environment
    if "COLAB_RELEASE_TAG" in known:
        return KernelReachability(route="static", proxy_helps=False)
    found = _find_server(known) if server is None else server
    hub = known.get("JUPYTERHUB_SERVICE_PREFIX")
    base = hub or (found.base if found is not None else "/")
    is_over_ssh = "SSH_CONNECTION" in known
    is_proxied = hub is not None or (
        found is not None and (found.hostname not in _LOOPBACK or base != "/" or is_over_ssh)
    )
    if _is_code(known, found, _find_cell() if cell is None else cell):
        return _find_code_reachability(known, is_proxied)
    if is_proxied:
        installed = find_spec("jupyter_server_proxy") is not None if has_proxy is None else has_proxy
        return KernelReachability(route="proxy" if installed else "static", base=base)
    return KernelReachability(route="loopback")


def _is_code(known: Mapping[str, str], server: Server | None, cell: str | None) -> bool:
    """Returns whether VS Code shows the notebook. A server that runs in its terminal has its variables, too."""
    if cell is not None:
        return cell.startswith(_CODE_CELL)
    return server is None and any(name.startswith("VSCODE_") for name in known)


def _find_code_reachability(known: Mapping[str, str], is_proxied: bool) -> KernelReachability:
    ports = known.get(_CODE_PORTS, "")
    if _CODE_SERVER in known and _PORT in ports:
        return KernelReachability(route="proxy", ports=ports)
    is_remote = _CODE_REMOTE in known and _CODE_WSL not in known
    is_elsewhere = is_proxied or is_remote or any(name in known for name in _CODE_REMOTE_SIGNS)
    return (
        KernelReachability(route="static", proxy_helps=False) if is_elsewhere else KernelReachability(route="loopback")
    )


def _find_cell() -> str | None:
    """Returns the id of the running cell; None if no cell runs, or if it has no id."""
    found = shell()
    parent = found.get_parent() if hasattr(found, "get_parent") else {}
    name = parent.get("metadata", {}).get("cellId")
    return name if isinstance(name, str) else None


def _find_server(environment: Mapping[str, str]) -> Server | None:
    """Returns the server whose child this kernel is; None if no server of this machine is its parent."""
    parent = environment.get("JPY_PARENT_PID", "")
    if "ipykernel" not in sys.modules or not parent.isdecimal():
        return None
    from jupyter_core.paths import jupyter_runtime_dir  # jupyter_server itself takes a second to load.

    try:
        entry: Any = json.loads((Path(jupyter_runtime_dir()) / f"jpserver-{parent}.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):  # Another program is the parent, or it runs elsewhere.
        return None
    return Server(hostname=str(entry.get("hostname", "")), base=str(entry.get("base_url", "/")))
