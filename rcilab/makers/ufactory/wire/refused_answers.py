"""Payloads of refused requests: the client library decodes every answer before it reads its status."""

from __future__ import annotations

from collections.abc import Sequence

from rcilab.makers.ufactory.wire.functions import Function

_SIZES: dict[int, int] = {
    6: 4,  # Radius of a rotation.
    Function.GET_IK: 28,
    Function.GET_FK: 24,
    Function.IS_JOINT_LIMIT: 1,
    Function.IS_TCP_LIMIT: 1,
    57: 1,  # Safety level.
    65: 1,  # Whether a trajectory is being read or written.
    Function.GET_POSE_OFFSET: 24,
    107: 4,  # Error register of a drive.
    **dict.fromkeys((111, 112, 113, 114), 12),  # Calibration of tool and user frame.
    115: 4,  # Identified friction,
    204: 40,  # and load.
    Function.TOOL_READ_16: 4,
    Function.TOOL_READ_32: 4,
    230: 12,  # Speeds of a recorded trajectory.
    231: 4,  # Largest joint speed.
    Function.GET_COMMON_PARAMETER: 4,
    Function.GET_COMMON_INFORMATION: 4,
}
_PARAMETER_SIZES = {6: 24, 7: 56, 12: 24, 14: 24, 15: 8, 16: 8}
"""Those of the common parameters that have several numbers."""


def refused_payload(function: int, values: Sequence[object] = ()) -> bytes:
    """Returns zeros of the size that the answer to a request would have.

    Args:
        function: Function code, also of a function that does not exist here.
        values: Of the request, if it could be decoded.
    """
    size = _SIZES.get(function, 0)
    if function == Function.GET_COMMON_PARAMETER and values and isinstance(values[0], int):
        size = _PARAMETER_SIZES.get(values[0], size)
    return bytes(size)
