"""The maker's client library, kept from what it does to a process.

When it is imported it creates a folder for logs in the user's home and prints; when it connects it changes the default
timeout of all sockets of the process. It needs none of that: its logs go to the terminal, and its own sockets have a
timeout of their own.
"""

from __future__ import annotations

import io
import os
import socket
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stdout
from importlib import import_module
from types import SimpleNamespace
from typing import Any

from rcilab.core.optional_deps import require_library


def load_client_library() -> Any:
    """Returns the class of the library's client.

    Its messages on the terminal are switched off, unless the user's program had imported it before.

    Raises:
        MissingExtraError: It is not installed; the message has the command that installs it.
    """
    if sys.modules.get("xarm") is None:
        with _temporary_home(), redirect_stdout(io.StringIO()):
            require_library("xarm.wrapper", "driving a UFACTORY arm", "xarm")
        logs = import_module("xarm.core.utils.log")
        logs.logger.disabled = logs.origin_logger.disabled = True
        for name, module in tuple(sys.modules.items()):
            if name.startswith("xarm."):
                vars(module)["print"] = lambda *texts, **options: None
    logger = import_module("xarm.core.utils.log").logger
    logger.warn = logger.warning  # The library still calls the deprecated one.
    ports: Any = import_module("xarm.core.comm.socket_port")
    ports.socket = SimpleNamespace(**vars(socket) | {"setdefaulttimeout": lambda seconds: None})
    return import_module("xarm.wrapper").XArmAPI


@contextmanager
def _temporary_home() -> Iterator[None]:
    home = os.environ.get("HOME")
    with tempfile.TemporaryDirectory() as folder:
        os.environ["HOME"] = folder
        try:
            yield
        finally:
            if home is None:
                del os.environ["HOME"]
            else:
                os.environ["HOME"] = home
