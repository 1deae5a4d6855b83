"""Loads that cannot be meant."""

from __future__ import annotations

import numpy as np
import pytest

from rcilab.core.errors import InvalidValueError
from rcilab.model.dynamics.payload import Payload


@pytest.mark.parametrize(
    ("facts", "said"),
    [
        ({"mass": 2500}, r"load mass must be from 0 to 100 \[kg\], got 2500.0"),
        ({"mass": -1}, "must be from 0 to 100"),
        ({"mass": float("nan")}, "must be from 0 to 100"),
        ({"mass": "2kg"}, r"load mass must be a number \[kg\], got '2kg'"),
        ({"mass": 1, "center_of_mass": [0, 0, 100]}, "farther than 5 m; the unit is metres"),
    ],
)
def test_grams_millimetres_and_words_are_refused(facts, said):
    with pytest.raises(InvalidValueError, match=said):
        Payload(**facts)


@pytest.mark.parametrize("inertia", ["x", ["x"], np.array(["x"]), [[1.0], [2.0, 3.0]], np.eye(2)])
def test_an_inertia_that_is_none_is_refused_in_plain_text(inertia):
    with pytest.raises(InvalidValueError) as caught:
        Payload(mass=1.0, inertia=inertia)
    assert str(caught.value).startswith(("load inertia ", "load inertia: "))
    assert "array(" not in str(caught.value)
    assert "dtype" not in str(caught.value)
