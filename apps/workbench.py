"""The workbench, wired by hand: the page of `rcilab`, for whoever wants to start it from a script of their own.

Run `python apps/workbench.py --help` for its options; `rcilab workbench` does the same.
"""

from __future__ import annotations

import argparse
import sys

from rcilab.cli.workbench import add_options, run
from rcilab.core.errors import RcilabError


def main() -> int:
    """Opens the page and serves it until Ctrl-C."""
    parser = argparse.ArgumentParser(description="Pose an arm, see its limits, run it at 1 kHz.")
    add_options(parser)
    try:
        return run(parser.parse_args())
    except RcilabError as error:
        print(f"workbench: {error}", file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main())
