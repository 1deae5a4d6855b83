"""Limit utilisation of a motion as colours along the path of its tool."""

from __future__ import annotations

import numpy as np

from rcilab.core.arrays import Array


def usage_colors(usage: Array) -> Array:
    """Returns colours from blue-green (low utilisation) over amber to red (a limit is violated), shape (N, 3)."""
    stops = np.array([0.0, 0.55, 0.9, 0.999, 1.0])
    colors = np.array([[20, 140, 170], [50, 170, 110], [225, 165, 25], [235, 130, 15], [214, 30, 38]], dtype=float)
    shares = np.clip(usage, 0.0, 1.0)
    return np.stack([np.interp(shares, stops, colors[:, channel]) for channel in range(3)], axis=1)
