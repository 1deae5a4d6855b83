"""`python -m rcilab.cli`: the same as `rcilab`."""

import sys

from rcilab.cli import main

sys.exit(main())
