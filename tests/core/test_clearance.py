import numpy as np
import pytest

from rcilab.core.clearance import ClearanceLimit
from rcilab.core.errors import InvalidValueError


@pytest.mark.parametrize("name", ["links", "floor", "advised", "floor_height", "tool_radius"])
@pytest.mark.parametrize("value", [float("nan"), float("inf"), "wide"])
def test_what_is_no_length_is_refused_by_name(name, value):
    with pytest.raises(InvalidValueError, match=name):
        ClearanceLimit(**{name: value})


def test_only_the_floor_may_be_below_zero_or_absent():
    assert ClearanceLimit(floor_height=-0.3).floor_height == -0.3
    assert ClearanceLimit(floor_height=None, tool_radius=None).floor_height is None
    for name in ("links", "floor", "advised", "tool_radius"):
        with pytest.raises(InvalidValueError, match=f"{name}.*must not be below 0"):
            ClearanceLimit(**{name: -1e-3})
    with pytest.raises(InvalidValueError, match="links"):
        ClearanceLimit(links=None)


def test_numbers_of_any_kind_make_the_same_value():
    assert ClearanceLimit(links=np.float32(0.5), floor=1) == ClearanceLimit(links=0.5, floor=1.0)
    assert repr(ClearanceLimit(floor=1)) == repr(ClearanceLimit(floor=1.0))
