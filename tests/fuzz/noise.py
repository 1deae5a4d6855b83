"""Sound input, spoilt: bits turned, parts cut out, doubled or exchanged, and words that mean something elsewhere."""

from __future__ import annotations

import random
from collections.abc import Iterator, Sequence

TOKENS = (
    b"", b"\x00", b"\xff\xff\xff\xff", b"\x7f\xff\xff\xff", b"\xff" * 8, b"NaN", b"Infinity", b"-1", b"1e999", b"null",
    b"[]", b"{}", b"[[[[[[[[[[", b'"', b"\\u0000", b"\xef\xbb\xbf", b"\n", b"\r", b";", b",", b"-", b"0x10", b"../",
    b"99999999999999999999", b"true", b"\xc0\x80", b"PK\x03\x04", b"\x93NUMPY", b"__class__",
)  # fmt: skip


def spoilt(corpus: Sequence[bytes], count: int, seed: int) -> Iterator[bytes]:
    """Yields so many spoilt copies of what is sound."""
    chance = random.Random(seed)
    for _ in range(count):
        content = bytearray(chance.choice(corpus))
        for _ in range(1 + chance.randrange(4)):
            _spoil(content, corpus, chance)
        yield bytes(content)


def _spoil(content: bytearray, corpus: Sequence[bytes], chance: random.Random) -> None:
    start = chance.randrange(len(content) + 1)
    end = min(len(content), start + chance.choice((1, 1, 2, 4, 8, 64, 1024)))
    match chance.randrange(7):
        case 0 if start < len(content):
            content[start] ^= 1 << chance.randrange(8)
        case 1:
            del content[start:end]
        case 2:
            content[start:start] = content[start:end]
        case 3:
            content[start:end] = chance.choice(TOKENS)
        case 4:
            content[start:start] = chance.choice(TOKENS)
        case 5:
            other = chance.choice(corpus)
            place = chance.randrange(len(other) + 1)
            content[start:] = other[place:]
        case _:
            content[start:end] = chance.randbytes(end - start)
