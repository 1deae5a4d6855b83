"""Motions in files: a versioned .npz that comes back to the last bit, and kind words for every other file."""

from __future__ import annotations

from io import BytesIO
from os import PathLike, fspath
from pathlib import Path
from typing import BinaryIO

import numpy as np

from rcilab.errors import InvalidValueError, VersionMismatchError
from rcilab.motion.motion import Motion
from rcilab.motion.piecewise import PiecewisePolynomial

KIND = "rcilab motion"
VERSION = 1


def save_motion(motion: Motion, file: str | PathLike[str] | BinaryIO) -> None:
    """Writes a motion; the name is kept as given, no ending is added.

    Raises:
        InvalidValueError: The file cannot be written.
    """
    content = {
        "kind": np.array(KIND),
        "version": np.array(VERSION),
        "law": np.array(motion.law),
        "speed": np.array(motion.speed),
        "breaks": motion.polynomial.breaks,
        "coefficients": motion.polynomial.coefficients,
        "goal": motion.goal,
    }
    if not isinstance(file, str | PathLike):
        np.savez(file, **content)
        return
    try:
        with open(file, "wb") as stream:
            np.savez(stream, **content)
    except OSError as error:
        raise InvalidValueError("motion file", fspath(file), f"cannot be written: {error.strerror}") from error


def load_motion(file: str | PathLike[str] | BinaryIO) -> Motion:
    """Returns the motion in a file.

    Raises:
        InvalidValueError: There is no such file, or it holds no sound motion.
        VersionMismatchError: It was written by another version of this format.
    """
    name = fspath(file) if isinstance(file, str | PathLike) else "stream"
    content = _read(file, name)
    if str(content.get("kind", "")) != KIND:
        found = ", ".join(content) or "nothing"
        raise InvalidValueError("motion file", name, f"holds no motion (found: {found}); save one with Motion.save")
    version = content.get("version")
    if version is None or version.shape != () or version != VERSION:
        raise VersionMismatchError(f"motion file {name!r}", None if version is None else version.tolist(), VERSION)
    try:
        curve = PiecewisePolynomial(content["breaks"], content["coefficients"])
        return Motion(
            polynomial=curve,
            goal=content["goal"],
            law=str(content["law"]),  # type: ignore[arg-type]  # Motion checks it.
            speed=float(content["speed"]),
        )
    except KeyError as error:
        raise InvalidValueError("motion file", name, f"is incomplete: no {error}") from error
    except (TypeError, ValueError) as error:
        raise InvalidValueError("motion file", name, f"holds a damaged motion: {error}") from error


def _read(file: str | PathLike[str] | BinaryIO, name: str) -> dict[str, np.ndarray]:
    if isinstance(file, str | PathLike):
        try:
            content = Path(file).read_bytes()
        except FileNotFoundError as error:
            raise InvalidValueError("motion file", name, "does not exist") from error
        except OSError as error:
            raise InvalidValueError("motion file", name, f"cannot be read: {error.strerror}") from error
    else:
        content = file.read()
    try:
        archive = np.load(BytesIO(content), allow_pickle=False)
        if isinstance(archive, np.ndarray):
            return {"a single array": archive}
        with archive:
            return {key: archive[key] for key in archive.files}
    # Foreign bytes make numpy, zipfile and zlib raise a dozen kinds of errors, NotImplementedError among them.
    except Exception as error:
        raise InvalidValueError("motion file", name, f"cannot be read as a motion: {error}") from error
