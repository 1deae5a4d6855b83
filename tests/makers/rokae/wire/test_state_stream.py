"""States that repeat: numbered anew on their way out, sharing their arrays on their way in."""

from __future__ import annotations

from random import Random

import pytest

from rcilab.core.errors import DecodeError
from rcilab.makers.rokae import wire as rci

FIELDS = [name for name in rci.decode_state(bytes(rci.STATE_SIZE), 7).__dataclass_fields__]


def shown(state) -> tuple[object, ...]:
    values = (getattr(state, name) for name in FIELDS)
    return tuple(value.tobytes() if hasattr(value, "tobytes") else value for value in values)


def datagrams(seed: int, count: int) -> list[bytes]:
    """Datagrams that differ now and then in a byte anywhere, and always in their number."""
    random, found = Random(seed), []
    body = bytearray(rci.STATE_SIZE)
    for number in range(count):
        if random.random() < 0.4:
            body[random.randrange(8, rci.STATE_SIZE)] = random.randrange(5)
        body[:8] = random.choice((number, random.getrandbits(64))).to_bytes(8, "big")
        found.append(bytes(body))
    return found


@pytest.mark.parametrize("n", [6, 7])
def test_a_stream_is_decoded_as_each_datagram_alone(n):
    decoder, shared = rci.StateDecoder(), 0
    last = None
    for datagram in datagrams(n, 2000):
        try:
            expected = rci.decode_state(datagram, n)
        except DecodeError:
            with pytest.raises(DecodeError):
                decoder.decode(datagram, n)
            continue
        state = decoder.decode(datagram, n)
        assert repr(shown(state)) == repr(shown(expected))
        shared += last is not None and state.q is last.q
        last = state
    assert shared > 500


def test_bytes_behind_a_state_are_ignored_and_a_short_one_is_refused():
    decoder, datagram = rci.StateDecoder(), bytes(rci.STATE_SIZE)
    first = decoder.decode(datagram, 7)
    assert decoder.decode(datagram + b"more", 7).q is first.q
    assert len(decoder.decode(datagram, 6).q) == 6
    for _ in range(2):
        with pytest.raises(DecodeError):
            decoder.decode(datagram[:-1], 7)


def test_a_renumbered_datagram_differs_in_its_number_alone():
    for datagram in datagrams(1, 50):
        again = rci.renumber_state(datagram, 2**63 + 5)
        assert again[8:] == datagram[8:]
        assert int.from_bytes(again[:8], "big") == 2**63 + 5
