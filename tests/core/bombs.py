"""Files of a few megabytes, or of none, that a careless reader unpacks to gigabytes or reads for minutes."""

from __future__ import annotations

import os
import struct
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np

import rcilab
from rcilab.recording.chunks import encode_chunk, encode_header

FAST = 1
"""Level of compression: zeros become small at each."""
_MODEL = rcilab.load_model("xMatePro7")
_TOO_LARGE = "MB, unpacked, are more than 1024.0"


def motion_with(name: str, head: bytes, zeros: int = 0) -> Callable[[Path], None]:
    """Returns what makes a motion one of whose arrays begins with other bytes, and goes on with zeros."""

    def make(path: Path) -> None:
        rcilab.plan_joint(_MODEL, _MODEL.home, _MODEL.home + 0.1).save(path)
        parts = {**dict(np.load(path)), "goal": np.zeros(1), "breaks": np.zeros(2)}
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=FAST) as file:
            for key in (key for key in parts if key != name):
                with file.open(f"{key}.npy", "w") as stream:
                    np.lib.format.write_array(stream, parts[key])
            with file.open(f"{name}.npy", "w", force_zip64=True) as stream:
                stream.write(head)
                for _ in range(zeros // 1_000_000):
                    stream.write(bytes(1_000_000))

    return make


def packed_zeros(count: int) -> bytes:
    """Returns what zlib makes of so many zeros: one block, which is made once, again and again."""
    block, rest = 1_000_000, count % 1_000_000
    pack, last = zlib.compressobj(9, wbits=-15), zlib.compressobj(9, wbits=-15)
    again = pack.compress(bytes(block)) + pack.flush(zlib.Z_FULL_FLUSH)
    checksum = (count % 65521) << 16 | 1  # Adler-32 of zeros.
    return (
        b"\x78\xda" + count // block * again + last.compress(bytes(rest)) + last.flush() + struct.pack(">I", checksum)
    )


def array_header(kind: str, shape: str) -> bytes:
    text = f"{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}".encode()
    return b"\x93NUMPY\x02\x00" + struct.pack("<I", len(text)) + text


def endless(path: Path) -> None:
    """A motion for a time that no whole number of cycles can express."""
    rcilab.plan_joint(_MODEL, _MODEL.home, _MODEL.home + 0.1).save(path)
    parts = dict(np.load(path))
    np.savez(path, **{**parts, "breaks": np.append(parts["breaks"][:-1], 1e308)})


def crowd(path: Path) -> None:
    """5000 arrays."""
    with zipfile.ZipFile(path, "w") as file:
        for number in range(5000):
            file.writestr(f"{number}.npy", array_header("<f8", "(0,)"))


def hollow(path: Path) -> None:
    """1 TB that takes no room on the disk."""
    path.touch()
    os.truncate(path, 2**40)


def blocks(path: Path) -> None:
    """A million blocks of a recording, each of them empty."""
    path.write_bytes(encode_header() + encode_chunk("HEAD", b"{}") + 1_000_000 * encode_chunk("CYCL", b""))


def long_head(path: Path) -> None:
    """60 MB of lists in a recording's head; each takes 20 times as much in memory."""
    head = b'{"fields": [' + 20_000_000 * b"[]," + b"[]]}"
    path.write_bytes(encode_header() + encode_chunk("HEAD", head))


def cells(path: Path) -> None:
    """2000 rows of 30 000 columns."""
    path.write_text(2000 * ("0," * 30_000 + "1\n"))


def old_lines(path: Path) -> None:
    """20 million lines that end as those of an old Macintosh."""
    path.write_text("0,1\r" * 20_000_000)


BOMBS: list[tuple[str, Callable[[Path], None], str]] = [
    (
        "header.npz",
        motion_with("notes", b"\x93NUMPY\x02\x00" + struct.pack("<I", 900_000_000), 900_000_000),
        "it is damaged",
    ),
    ("no_size.npz", motion_with("notes", array_header("<U0", "(1_000_000_000,)")), _TOO_LARGE),
    ("digits.npz", motion_with("notes", array_header("<f8", f"({10**4000},)")), _TOO_LARGE),
    (
        "powers.npz",
        motion_with("coefficients", array_header("<f8", "(1, 1, 100_000_000)"), 800_000_000),
        "at most 64 powers",
    ),
    (
        "bytes.npz",
        motion_with("coefficients", array_header("|u1", "(1, 1, 800_000_000)"), 800_000_000),
        f"6400.0 {_TOO_LARGE}",
    ),
    ("endless.npz", endless, "must end before 1e+12 [s]"),
    ("crowd.npz", crowd, "it is damaged"),
    ("hollow.npz", hollow, _TOO_LARGE),
    ("hollow.csv", hollow, _TOO_LARGE),
    ("hollow.rcirun", hollow, _TOO_LARGE),
    ("hollow.json", hollow, "1099511.6 MB is above 8 MB"),
    ("blocks.rcirun", blocks, "it has more than 63500 chunks"),
    ("head.rcirun", long_head, "the maximum is 4000000"),
    ("cells.csv", cells, "30001 columns are more than 1024"),
    ("lines.csv", old_lines, "20000001 rows of 1 ms are more than 1000000"),
]
"""Name of the file, what makes it, and what is said of it."""
