"""One page holds the controls, the others watch."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from rcilab.workbench.lease import Lease


def test_the_first_page_gets_the_controls_and_the_next_one_inherits_them():
    lease = Lease().arrive(7).arrive(9)
    assert lease.holder == 7
    assert lease.allows(7)
    assert not lease.allows(9)
    assert lease.leave(7).holder == 9
    assert lease.leave(7).leave(9) == Lease()


def test_a_page_can_take_the_controls_but_only_while_it_is_open():
    lease = Lease().arrive(1).arrive(2)
    assert lease.take(2).holder == 2
    assert lease.take(5) == lease


def test_our_own_doing_is_always_allowed():
    assert Lease().allows(None)


@given(st.lists(st.tuples(st.sampled_from(["arrive", "leave", "take"]), st.integers(0, 4)), max_size=40))
def test_the_holder_is_always_an_open_page_and_none_only_when_none_is_open(events):
    lease = Lease()
    for name, page in events:
        lease = getattr(lease, name)(page)
        assert len(set(lease.pages)) == len(lease.pages)
        assert (lease.holder in lease.pages) if lease.pages else lease.holder is None
        assert lease.number(lease.holder) == (lease.pages.index(lease.holder) + 1 if lease.pages else 0)
