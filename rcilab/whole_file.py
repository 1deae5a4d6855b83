"""Small files that are exchanged as a whole: whoever reads meets the old one or the new one, also after a crash."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path


def write_whole(file: Path, text: str, *, survives_power_loss: bool = True) -> None:
    """Writes a text file, and the folders it is in; nothing of it is left where that fails.

    Args:
        file: Where.
        text: What.
        survives_power_loss: Whether to wait until the disk has it; a killed process loses nothing in any case.

    Raises:
        OSError: It cannot be written.
    """
    file.parent.mkdir(parents=True, exist_ok=True)
    handle, temporary = tempfile.mkstemp(dir=file.parent, prefix=f".{file.stem}-")
    try:
        with os.fdopen(handle, "w", encoding="utf-8") as out:
            out.write(text)
            if survives_power_loss:
                out.flush()
                os.fsync(out.fileno())
        os.replace(temporary, file)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise
