"""A virtual RCI controller: a pure core that lives one millisecond at a time, and a thin server around it."""

from rcilab.controller.config import ControllerConfig
from rcilab.controller.server import ControllerServer

__all__ = ["ControllerConfig", "ControllerServer"]
