"""Every reader of files gives a value or one of our errors, whatever is in the file."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from io import BytesIO
from pathlib import Path

import numpy as np

import rcilab
from rcilab.core.errors import RcilabError
from rcilab.motion import Motion, Program, Waypoint
from rcilab.recording.run import decode_run
from tests.fuzz.noise import spoilt
from tests.recording.runs import MODEL, PLAN, SETUP, export_run, some_cycles

_ROWS = 20_000  # A spoilt length may be any; no test needs more.


def recordings() -> list[bytes]:
    from rcilab.recording.run import build_run

    run = build_run(some_cycles(20), plan=PLAN, model=MODEL, setup=SETUP)
    return [export_run(run, ".rcirun")]


def motions() -> list[bytes]:
    stream = BytesIO()
    rcilab.plan_joint(MODEL, MODEL.home, MODEL.home + 0.01).save(stream)
    samples = BytesIO()
    np.savez(samples, t=np.arange(5) / 10.0, q=np.zeros((5, 7)))
    return [stream.getvalue(), samples.getvalue()]


def programs() -> list[bytes]:
    T = MODEL.forward(MODEL.home)
    steps = (
        Waypoint.line(T, blend=0.03, speed=0.3), Waypoint.joint(MODEL.home), Waypoint.nullspace(0.3),
        Waypoint.circle((0.4, 0.0, 0.3), (0.0, 0.0, 1.0), dwell=1.0),
    )  # fmt: skip
    return [Program(model=MODEL.name, start=MODEL.home, waypoints=steps).to_json().encode()]


def tables() -> list[bytes]:
    rows = "\n".join(",".join([f"{0.1 * i:.3f}", *(f"{0.01 * i * j:.4f}" for j in range(7))]) for i in range(6))
    return [rows.encode(), b't [ms];q1 [deg];q2\n0;1;2\n100;1,5;2.5\n200;1e1;"3"\n', b"# a\n1\t2\t3\n2\t3\t4\n"]


def _table(content: bytes, folder: Path) -> object:
    file = folder / "a.csv"
    file.write_bytes(content)
    return Motion.load(file, max_rows=_ROWS)


KINDS: dict[str, tuple[Callable[[], Sequence[bytes]], Callable[[bytes, Path], object]]] = {
    "recording": (recordings, lambda content, folder: decode_run(content, max_rows=_ROWS)),
    "motion": (motions, lambda content, folder: Motion.load(BytesIO(content), max_rows=_ROWS)),
    "program": (programs, lambda content, folder: Program.from_json(content, "program.json")),
    "CSV": (tables, _table),
}


def fuzz_file(kind: str, count: int, seed: int, folder: Path) -> int:
    """Reads so many spoilt files; returns how many were read nevertheless. What is raised but our errors is a bug."""
    make, read = KINDS[kind]
    corpus = make()
    read(corpus[0], folder)  # The first one is sound.
    sound, problems = 0, []
    for number, content in enumerate(spoilt(corpus, count, seed)):
        try:
            read(content, folder)
            sound += 1
        except RcilabError as error:
            problems.append(str(error))
        except Exception as error:
            raise AssertionError(f"{kind} {number} of seed {seed}: {content[:200]!r}") from error
    assert [problem for problem in problems if "\n" in problem] == []
    return sound
