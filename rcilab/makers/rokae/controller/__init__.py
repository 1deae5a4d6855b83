"""A virtual RCI controller: a pure core that lives one millisecond at a time, and a thin server around it."""

from rcilab.makers.rokae.controller.config import ControllerConfig
from rcilab.makers.rokae.controller.server import ControllerServer

__all__ = ["ControllerConfig", "ControllerServer"]
