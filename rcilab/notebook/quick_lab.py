"""JupyterLab's main program in half of its time: what it would load and ask for, and never uses here, is left out.

Its libraries check what they exchange by jsonschema, which builds a grammar of international web addresses as it is
loaded, for a format that nothing of JupyterLab has; where that library is missing, jsonschema leaves the format out.
And where node is installed JupyterLab asks yarn for the registry that a build of its page would download from.
"""

from __future__ import annotations

import sys
from typing import Any


def main() -> Any:
    """Becomes JupyterLab with this program's arguments, and returns its exit code."""
    sys.modules.setdefault("rfc3987_syntax", None)  # pyright: ignore[reportArgumentType]
    import jupyterlab.commands

    jupyterlab.commands._yarn_config = lambda logger: {"yarn config": {}, "npm config": {}}
    from jupyterlab.labapp import main as run

    return run()


if __name__ == "__main__":
    sys.exit(main())
