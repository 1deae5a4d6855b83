"""The lab as a short program: JupyterLab on a directory of your own, with the lessons copied into it once.

    python apps/lab.py [DIRECTORY]

Start from here to hand a class its notebooks: everybody gets copies, and the lessons themselves stay as they are.
"""

from __future__ import annotations

import argparse
import shutil
from pathlib import Path

from rcilab.notebook.lab import find_notebooks, lab_command, open_lab


def main() -> int:
    """Copies the lessons that are not there yet and opens JupyterLab on them."""
    parser = argparse.ArgumentParser(description="Open JupyterLab on your own copies of the lessons.")
    parser.add_argument("directory", nargs="?", type=Path, default=Path.home() / "rcilab-notebooks")
    directory: Path = parser.parse_args().directory
    directory.mkdir(parents=True, exist_ok=True)
    for lesson in sorted(find_notebooks().glob("*.ipynb")):
        if not (directory / lesson.name).exists():
            shutil.copy(lesson, directory)
    print(f"your notebooks are in {directory}")
    return open_lab(lab_command(directory))


if __name__ == "__main__":
    raise SystemExit(main())
