"""Plots of the page and of an exported file have the same units and the same smallest ranges."""

from __future__ import annotations

import numpy as np
import pytest

from rcilab.i18n.plot_scale import plot_scale
from rcilab.i18n.units import Units

SI = Units(angle="rad", length="m")


def test_errors_are_shown_in_thousandths_of_the_unit_chosen_where_a_page_is_in_radians_and_metres():
    shown = {(name, units): plot_scale(name, units) for name in ("error", "tool", "q") for units in (Units(), SI)}
    assert {key: (scale.factor, scale.unit) for key, scale in shown.items()} == {
        ("error", Units()): (pytest.approx(np.degrees(1.0)), "°"),
        ("tool", Units()): (1000.0, "mm"),
        ("error", SI): (1000.0, "mrad"),
        ("tool", SI): (1000.0, "10⁻³ m"),
        ("q", Units()): (pytest.approx(np.degrees(1.0)), "°"),
        ("q", SI): (1.0, "rad"),
    }


def test_a_number_in_thousandths_of_a_metre_reads_as_a_product():
    assert plot_scale("tool", SI).with_unit("0.25") == "0.25·10⁻³ m"
    assert plot_scale("tool").with_unit("0.25") == "0.25 mm"
    assert plot_scale("error").with_unit("0.25") == "0.25 °"


def test_the_smallest_range_is_the_same_angle_in_every_unit_and_its_hundredth_is_told():
    assert plot_scale("error").least == pytest.approx(0.02)
    assert plot_scale("error", SI).least == pytest.approx(1e3 * np.radians(0.02))
    assert (plot_scale("error").digits, plot_scale("error", SI).digits, plot_scale("q", SI).digits) == (4, 3, 4)
