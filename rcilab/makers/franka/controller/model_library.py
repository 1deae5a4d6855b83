"""The shared library that a controller of version 5 answers to LoadModelLibrary.

A client loads it into its own process and calls its 30 functions: poses and Jacobians of the joints' frames, mass
matrix, Coriolis torques and gravity. It is compiled for this machine by its own compiler, from `model_library.c` and
the tables of the arm, and kept in the user's cache folder under a name made of its content.
"""

from __future__ import annotations

import hashlib
import platform
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable
from importlib import resources
from pathlib import Path

import numpy as np

from rcilab.core.arrays import Array
from rcilab.core.atomic_file import replacing
from rcilab.core.cache_folder import cache_folder
from rcilab.core.errors import ModelError
from rcilab.makers.franka.controller.craig_bodies import craig_bodies, craig_placement
from rcilab.makers.franka.robots.arm import CRAIG
from rcilab.robots.description import RobotDescription

COMPILERS = ("cc", "gcc", "clang")
_OPTIONS = ("-std=c99", "-O2", "-ffp-contract=off", "-fvisibility=hidden", "-fPIC", "-shared")
_COMPILE_TIMEOUT = 60.0  # [s]
_ARCHITECTURES = {"x86_64": 0, "amd64": 0, "i386": 1, "i686": 1, "armv7l": 2, "aarch64": 3, "arm64": 3}
_LINUX = 0
_ELF = b"\x7fELF"
"""Beginning of a library; a file of the cache without it was not written to its end."""


def build_model_library(description: RobotDescription, cache: Path | None = None) -> bytes:
    """Returns the library of an arm with Franka's geometry, for this machine.

    The first time it compiles for some tenths of a second: do so before the first cycle.

    Args:
        description: The arm.
        cache: Folder of compiled libraries; None is `rcilab` in the user's cache folder. Without a folder that can be
            written it is compiled every time.

    Raises:
        ModelError: There is no compiler, or it failed; the message has the remedy.
    """
    source = library_source(description)
    folder = cache_folder() if cache is None else cache
    key = hashlib.sha256("\0".join((platform.machine(), *_OPTIONS, source)).encode()).hexdigest()
    file = folder / f"franka-model-{key[:32]}.so"
    try:
        library = file.read_bytes()
    except OSError:
        library = b""
    if library.startswith(_ELF):
        return library
    library = _compile(source)
    try:
        folder.mkdir(parents=True, exist_ok=True)
        with replacing(file) as stream:
            stream.write(library)
    except OSError:
        pass  # The next controller compiles again.
    return library


def runs_here(architecture: int, system: int) -> bool:
    """Returns whether a client's machine is like this one, by the numbers in its request."""
    return sys.platform == "linux" and (architecture, system) == (
        _ARCHITECTURES.get(platform.machine().lower()),
        _LINUX,
    )


def library_source(description: RobotDescription) -> str:
    """Returns the source of the library: the tables of the arm, and `model_library.c`."""
    placements = np.array([craig_placement(row) for row in CRAIG])
    links = craig_bodies(description)[1:]
    tables = (
        _table("JOINT_ROTATION", placements[:, :3, :3].reshape(-1, 9)),
        _table("JOINT_POSITION", placements[:, :3, 3]),
        f"static const double MASS[{len(links)}] = {_row(link.mass for link in links)};",
        _table("CENTER", np.array([link.center_of_mass for link in links])),
        _table("INERTIA", np.array([link.inertia.ravel() for link in links])),
    )
    code = resources.files("rcilab.makers.franka.controller").joinpath("model_library.c").read_text(encoding="utf-8")
    return "\n".join((*tables, code))


def _table(name: str, rows: Array) -> str:
    text = ",\n  ".join(_row(row) for row in rows.tolist())
    return f"static const double {name}[{len(rows)}][{rows.shape[1]}] = {{\n  {text}\n}};"


def _row(numbers: Iterable[float]) -> str:
    return "{" + ", ".join(repr(float(number)) for number in numbers) + "}"


def _compile(source: str) -> bytes:
    compiler = next((path for name in COMPILERS if (path := shutil.which(name))), None)
    if compiler is None:
        raise ModelError(
            f"the model library of version 5 needs a C compiler ({', '.join(COMPILERS)}), and none is installed; "
            "install one, on Debian or Ubuntu: apt install gcc libc6-dev"
        )
    try:
        with tempfile.TemporaryDirectory(prefix="rcilab-") as folder:
            file = Path(folder) / "model.so"
            command = [compiler, *_OPTIONS, "-x", "c", "-", "-o", str(file), "-lm"]
            done = subprocess.run(
                command, input=source.encode(), capture_output=True, timeout=_COMPILE_TIMEOUT, check=False
            )
            library = file.read_bytes() if file.exists() else b""
    except (OSError, subprocess.TimeoutExpired) as error:
        raise ModelError(f"the model library of version 5 was not compiled: {error}") from error
    if done.returncode or not library.startswith(_ELF):
        lines = done.stderr.decode(errors="replace").strip().splitlines()
        first = next(iter(lines), "no message, and no library")
        raise ModelError(f"the model library of version 5 was not compiled by {compiler}: {first}")
    return library
