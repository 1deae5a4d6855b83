"""Loads that cannot be meant."""

from __future__ import annotations

import numpy as np
import pytest

from rcilab.core.errors import InvalidValueError
from rcilab.model.dynamics.payload import Payload
from rcilab.model.robot_model import load_model


@pytest.mark.parametrize(
    ("facts", "said"),
    [
        ({"mass": -1}, r"load mass must be a finite number, 0 or more \[kg\], got -1.0"),
        ({"mass": float("nan")}, "must be a finite number, 0 or more"),
        ({"mass": float("inf")}, "must be a finite number, 0 or more"),
        ({"mass": "2kg"}, r"load mass must be a number \[kg\], got '2kg'"),
        ({"mass": 1, "center_of_mass": [0, 0, 100]}, "farther than 2 m; the unit is metres"),
        ({"mass": 1, "center_of_mass": [0, 1.5, 1.5]}, "farther than 2 m"),
    ],
)
def test_grams_millimetres_and_words_are_refused(facts, said):
    with pytest.raises(InvalidValueError, match=said):
        Payload(**facts)


@pytest.mark.parametrize("mass", [7.1, 2500.0, 1e300])
def test_a_load_above_the_payload_is_compared_with_that_whatever_its_mass(mass: float) -> None:
    with pytest.raises(InvalidValueError, match="kg is above 7 kg for xMatePro7, the payload it is rated for"):
        load_model("xMatePro7").with_load(Payload(mass=mass))


@pytest.mark.parametrize("inertia", ["x", ["x"], np.array(["x"]), [[1.0], [2.0, 3.0]], np.eye(2)])
def test_an_inertia_that_is_none_is_refused_in_plain_text(inertia):
    with pytest.raises(InvalidValueError) as caught:
        Payload(mass=1.0, inertia=inertia)
    assert str(caught.value).startswith(("load inertia ", "load inertia: "))
    assert "array(" not in str(caught.value)
    assert "dtype" not in str(caught.value)
