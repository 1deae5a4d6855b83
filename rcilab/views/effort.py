"""How hard a motion drives the arm, as colours along the path of its tool."""

from __future__ import annotations

import numpy as np

from rcilab.arrays import Array


def effort_colors(effort: Array) -> Array:
    """Returns colours from blue-green (little of the velocity limit used) over amber to red (all of it), (N, 3)."""
    stops = np.array([0.0, 0.6, 0.9, 1.0])
    colors = np.array([[20, 150, 160], [60, 175, 90], [240, 150, 20], [214, 48, 38]], dtype=float)
    shares = np.clip(effort, 0.0, 1.0)
    return np.stack([np.interp(shares, stops, colors[:, channel]) for channel in range(3)], axis=1)
