"""The content of a plot, without a plotting library."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from rcilab.views.plots import Frame, peak_of


def test_the_largest_value_of_a_plot_is_found_with_its_curve_and_time() -> None:
    t = np.linspace(0.0, 1.0, 5)
    nothing = np.full(5, np.nan)
    frame = Frame(
        t=t,
        plan=(np.array([0.0, 1.0, -4.0, 2.0, np.nan]), nothing),
        actual=(),
        upper=nothing,
        lower=nothing,
        violated=np.zeros(5, dtype=bool),
        bound=5.0,
        end=1.0,
    )
    assert peak_of(frame) == (0, -4.0, 0.5)
    assert peak_of(replace(frame, actual=(nothing, np.array([0.0, 3.0, 0.0, 0.0, 0.0])))) == (1, 3.0, 0.25)
    assert peak_of(replace(frame, plan=())) is None
    assert peak_of(replace(frame, plan=(nothing,))) is None
