"""The legends in the scene: the colours of the planned path, and those of the workspace with its cut."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rcilab.app.text import Text
from rcilab.views.usage_colors import usage_colors
from rcilab.workbench.scene.extras_view import cloud_colors

if TYPE_CHECKING:
    from rcilab.app.store import UiState
    from rcilab.model.kinematics.workspace import Workspace

_CELLS = 20  # Of a bar, one colour each.


def scene_legends(state: UiState, text: Text) -> list[dict[str, Any]]:
    """Returns the legends of what the scene shows, for `LiveChannel.publish`."""
    legends: list[dict[str, Any]] = []
    if state.plan is not None and state.scene.ribbon is not None:
        legends.append(
            {
                "id": "path", "title": text("legend.path"), "colors": _path_colors(), "ends": ["0 %", "100 %"],
                "beyond": {"color": _css(usage_colors(np.array([1.0])))[0], "label": text("legend.violated")},
            }
        )  # fmt: skip
    if state.scene.cloud is not None:
        ends = [text("legend.singular"), text("legend.dexterous")]
        cut = _cut(state, state.scene.cloud, text)
        legends.append(
            {"id": "cloud", "title": text("extra.cloud"), "colors": _cloud_colors(), "ends": ends, "cut": cut}
        )
    return legends


def _cut(state: UiState, cloud: Workspace, text: Text) -> dict[str, Any]:
    cut, (low, high) = state.scene.cut, _extent(cloud)
    return {
        "label": text("legend.cut"), "off": text("legend.whole"), "low": low, "high": high,
        "axis": "none" if cut is None else cut.axis,
        "at": 0.0 if cut is None else cut.at,
        "shown": "" if cut is None else text.units.format_length(cut.at),
    }  # fmt: skip


def _extent(cloud: Workspace) -> tuple[float, float]:
    """Returns the smallest and the largest coordinate of a workspace, [m]."""
    return round(float(cloud.position.min()), 2), round(float(cloud.position.max()), 2)


@cache
def _path_colors() -> list[str]:
    return _css(usage_colors(np.linspace(0.0, 0.998, _CELLS)))


@cache
def _cloud_colors() -> list[str]:
    return _css(cloud_colors(np.linspace(0.0, 1.0, _CELLS)))


def _css(colors: NDArray[np.floating | np.integer]) -> list[str]:
    return [f"rgb({red:.0f}, {green:.0f}, {blue:.0f})" for red, green, blue in colors]
