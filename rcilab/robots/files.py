"""Robot descriptions on disk: the description file and the meshes it refers to."""

from __future__ import annotations

from pathlib import Path

from rcilab.core.atomic_file import replacing
from rcilab.core.errors import ModelError
from rcilab.robots.description import RobotDescription
from rcilab.robots.urdf import build_meshes


def write_model(directory: Path, file_name: str, text: str, description: RobotDescription) -> Path:
    """Writes a URDF or MJCF and its meshes (`meshes/NAME/*.stl`), and returns the path of the description file.

    Raises:
        ModelError: The directory cannot be written; the message has the reason.
    """
    try:
        meshes = directory / "meshes" / description.name
        meshes.mkdir(parents=True, exist_ok=True)
        for name, content in build_meshes(description).items():
            with replacing(meshes / name) as stream:
                stream.write(content)
        path = directory / file_name
        with replacing(path) as stream:
            stream.write(text.encode())
    except OSError as error:
        raise ModelError(
            f"cannot write {file_name} into {directory}: {error.strerror}; use another --output"
        ) from error
    return path
