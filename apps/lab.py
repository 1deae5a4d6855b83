"""The lab as a short program: JupyterLab on a directory of your own, with copies of the lessons in it.

    python apps/lab.py [DIRECTORY]

Start from here to hand a class its notebooks: everybody gets copies, and the lessons themselves stay as they are.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from rcilab.notebook.lab import lab_command, open_lab
from rcilab.notebook.lessons import FOLDER, copy_lessons


def main() -> int:
    """Copies the lessons, edited copies excepted, and opens JupyterLab on them."""
    parser = argparse.ArgumentParser(description="Open JupyterLab on your own copies of the lessons.")
    parser.add_argument("directory", nargs="?", type=Path, default=Path.home() / FOLDER)
    parser.add_argument("--allow-root", action="store_true", help="run as root, as in a container")
    args = parser.parse_args()
    copied = copy_lessons(args.directory)
    print(copied)
    return open_lab(lab_command(copied.folder, allow_root=args.allow_root))


if __name__ == "__main__":
    raise SystemExit(main())
