"""What `forked_kernels` loads once for all of them."""

import os
import sys

sys.dont_write_bytecode = False  # As tests/conftest.py.
os.environ["MPLBACKEND"] = "module://matplotlib_inline.backend_inline"  # As a kernel says it, before it is read.

import ipykernel.ipkernel  # noqa: E402
import ipykernel.kernelapp  # noqa: E402, F401
import matplotlib.pyplot  # noqa: E402, F401
import pinocchio  # noqa: E402, F401
import ruckig  # noqa: E402, F401
import tornado.web  # noqa: E402, F401
