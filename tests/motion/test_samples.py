import re
from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rcilab.conformance.check import check
from rcilab.core.clock import CYCLE_TIME
from rcilab.core.errors import InvalidValueError
from rcilab.model.robot_model import load_model
from rcilab.motion import Motion, motion_through, plan_joint
from tests.recording.runs import some_run

MODEL = load_model("xMatePro7")
PLANNED = plan_joint(MODEL, MODEL.home, MODEL.home + 0.4, speed=0.3)


def file_of(tmp_path, text, name="moves.csv"):
    path = tmp_path / name
    path.write_bytes(text if isinstance(text, bytes) else text.encode())
    return path


@settings(max_examples=60)
@given(st.integers(0, 2**32), st.integers(2, 40))
def test_the_spline_passes_every_sample_from_rest_to_rest_with_continuous_acceleration(seed, count):
    rng = np.random.default_rng(seed)
    times = 3.0 + np.cumsum(rng.uniform(0.004, 0.3, count))
    q = rng.uniform(-2.0, 2.0, (count, 6))
    motion = motion_through(times, q)
    curve = motion.polynomial
    assert np.allclose(curve.sample(times - times[0]), q, rtol=0.0, atol=1e-12)
    assert motion.duration == pytest.approx(times[-1] - times[0], abs=1e-12)
    for instant in (curve.at(0.0), curve.at_end()):
        scale = np.abs(curve.coefficients).max()
        assert np.abs(instant[1]).max() < 1e-12 * scale
        assert np.abs(instant[2]).max() < 1e-12 * scale
    # What piece s says at its end, piece s + 1 says at its beginning: q, dq and ddq.
    h = np.diff(curve.breaks)[:-1, np.newaxis]
    c = curve.coefficients
    for order, factors in ((0, (1, 1, 1, 1)), (1, (0, 1, 2, 3)), (2, (0, 0, 2, 6))):
        left = sum(factors[p] * c[:-1, :, p] * h ** (p - order) for p in range(order, 4))
        assert np.allclose(left, factors[order] * c[1:, :, order], rtol=1e-9, atol=1e-9 * np.abs(c).max())


def test_a_planned_motion_sampled_at_100_hz_comes_back_and_conforms():
    t = np.append(np.arange(0.0, PLANNED.duration, 0.01), PLANNED.duration)
    motion = motion_through(t, [PLANNED.at(x).q for x in t])
    assert np.abs(motion.q - PLANNED.q).max() < 2e-5  # A jerk of 5000 rad/s^3 within one interval is not seen.
    assert motion.law == "samples"
    assert check(motion, MODEL).ok


def test_rows_of_the_1_ms_grid_are_kept():
    motion = motion_through(PLANNED.times, PLANNED.q)
    assert len(motion) == len(PLANNED)
    assert np.allclose(motion.q, PLANNED.q, rtol=0.0, atol=1e-12)


def test_csv_and_npz_in_every_dress_give_the_same_motion(tmp_path):
    t, q = PLANNED.times[::20], PLANNED.q[::20]
    expected = motion_through(t, q)
    degrees = np.degrees(q)

    def rows(times, angles, mark=","):
        columns = angles if times is None else np.column_stack((times, angles))
        return "".join(mark.join(repr(float(x)) for x in row) + "\n" for row in columns)

    names = [f"q{i}" for i in range(1, 8)]
    swapped = np.column_stack((q[:, ::-1], t))
    texts = {
        "t," + ",".join(names) + "\n" + rows(t, q): {},
        '"time [ms]";' + ";".join(f"q[{i}] [deg]" for i in range(1, 8)) + "\n" + rows(1e3 * t, degrees, ";"): {},
        "# by hand\n\n" + rows(t, q, "\t"): {},
        rows(t, degrees, " "): {"unit": "deg"},
        rows(None, q): {"rate_hz": 50},
        "\ufeff" + ",".join(f"joint_{i}" for i in range(7, 0, -1)) + ",t\r\n" + rows(None, swapped): {},
        "t,dq1,"
        + ",".join(names)
        + ",note\n"
        + "".join(
            f"{a!r},nan,{','.join(map(repr, b))},fine\n" for a, b in zip(t.tolist(), q.tolist(), strict=True)
        ): {},
    }
    for text, options in texts.items():
        motion = Motion.load_samples(file_of(tmp_path, text), **options)
        assert np.allclose(motion.q, expected.q, rtol=0.0, atol=1e-9), text[:60]
    np.savez(tmp_path / "timed.npz", t=t, q=q)
    np.savez(tmp_path / "even.npz", q=degrees)
    for name, options in (("timed.npz", {}), ("even.npz", {"rate_hz": 50, "unit": "deg"})):
        motion = Motion.load_samples(tmp_path / name, **options)
        assert np.allclose(motion.q, expected.q, rtol=0.0, atol=1e-9)


@pytest.mark.parametrize(
    ("text", "options", "message"),
    [
        ("", {}, "moves.csv' has no rows"),
        ("t,q1\n", {}, "no rows below the header"),
        ("0,1\n0.1,x\n", {}, "line 2: 'x' in column 2 is not a finite number"),
        ("# a\n\nt,q1\n0,1\n0.1,nan\n", {}, "line 5: 'nan' in column 2"),
        ("0;1,5\n1;1,6\n", {}, "line 1: '1,5' in column 2 is not a finite number; use a point for decimals"),
        ("0,1,2\n0.1,1\n", {}, "line 2: 2 columns; the first line has 3"),
        ("0,1,2\n0.1\n", {}, "line 2: 1 column; the first line has 3"),
        ("0,1\n0.1,1\n0.1,1\n", {}, "line 3: 0.1 s is not later than the sample before"),
        ("0\n1\n", {}, "line 1 needs a time and the joints.*, got 'a single column'"),
        ("t,q1,q3\n0,1,1\n", {}, r"line 1: .*names the joints 1, 3; needs q1, q2"),
        ("t,q1,joint_1\n0,1,1\n", {}, "line 1: 'joint_1' is a second column for joint 1"),
        ("t,time,q1\n0,0,1\n", {}, "line 1: 'time' is a second column of times"),
        ("speed,power\n0,1\n", {}, "line 1: .*names the joints none"),
        ("q1,q2\n0,1\n", {}, r"no times; add a column t \[s\] or, in Python, pass rate_hz"),
        ("t,q1\n0,1\n", {"rate_hz": 100}, "is not needed"),
        ("t,q1\n0,1\n1,90\n", {}, r"line 3: 90.0 rad of joint 1 .*unit='deg'"),
        (b"t,q1\n0,1\n\xff\xfe,2\n", {}, "line 3: .*not UTF-8 text"),
        ("t,q" + "9" * 5000 + "\n0,1\n", {}, "names the joints none"),
        ("-1e308,1\n1e308,1\n", {}, r"line 1: -1e\+308 s is more than 1e\+20; are the times in s"),
        ("t,q1\n0,1\n", {"unit": "gon"}, "unit: 'gon' is unknown; known: rad, deg"),
        ("0,1\n", {"rate_hz": 0}, "rate_hz must be above 0.*, got 0.0"),
    ],
)
def test_a_bad_csv_is_named_with_its_line_in_one_sentence(tmp_path, text, options, message):
    with pytest.raises(InvalidValueError) as caught:
        Motion.load_samples(file_of(tmp_path, text), **options)
    assert re.search(message, str(caught.value))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ({"x": np.zeros(3)}, r"has no array q of joint angles \(found: x\)"),
        ({"q": np.zeros(3)}, r"needs shape \(N, n\)"),
        ({"q": np.zeros((3, 8)), "t": np.arange(3.0)}, "at most 7 joints"),
        ({"q": np.zeros((3, 7)), "t": np.zeros(2)}, r"t: .* needs \(3,\)"),
        ({"q": np.zeros((3, 7)), "t": [0.0, 2.0, 1.0]}, r"row 2 \(from 0\): 1.0 s is not later"),
        ({"q": np.zeros((3, 7))}, "pass rate_hz"),
        ({"q": np.zeros((3, 7), complex), "t": np.arange(3.0)}, "q needs real numbers, got array of complex128"),
        ({"q": np.zeros((3, 7)), "t": np.arange(3).astype("M8[s]")}, "t needs real numbers"),
        ({"q": np.array([[0.0], [np.nan]]), "t": [0.0, 1.0]}, "row 1 .*finite"),
    ],
)
def test_a_bad_npz_is_named_with_its_row(tmp_path, arrays, message):
    np.savez(tmp_path / "moves.npz", **arrays)
    with pytest.raises(InvalidValueError, match=message):
        Motion.load_samples(tmp_path / "moves.npz")


def test_what_is_no_file_of_samples_is_named(tmp_path):
    PLANNED.save(tmp_path / "saved.npz")
    with pytest.raises(InvalidValueError, match=r"saved motion; load it with Motion\.load"):
        Motion.load_samples(tmp_path / "saved.npz")
    with pytest.raises(InvalidValueError, match="does not exist"):
        Motion.load_samples(tmp_path / "none.csv")
    with pytest.raises(InvalidValueError, match=r"must end in \.csv or \.npz"):
        Motion.load_samples(file_of(tmp_path, "0,1", "moves.txt"))
    with pytest.raises(InvalidValueError, match="damaged"):
        Motion.load_samples(file_of(tmp_path, b"PK nonsense", "moves.npz"))


@settings(max_examples=100)
@given(st.binary(max_size=200))
def test_any_bytes_give_a_motion_or_are_refused(tmp_path_factory, content):
    for ending in ("csv", "npz"):
        path = file_of(tmp_path_factory.mktemp("any"), content, f"any.{ending}")
        with suppress(InvalidValueError):  # Anything else that is raised fails the test.
            Motion.load_samples(path, rate_hz=100)


def test_a_bad_sample_is_for_check_to_find():
    q = PLANNED.q.copy()
    q[200, 3] += 1e-3
    report = check(motion_through(np.arange(len(q)) * CYCLE_TIME, q), MODEL)
    assert not report.ok
    assert {violation.joint for violation in report.violations} == {4}


def test_times_that_do_not_increase_are_refused():
    with pytest.raises(InvalidValueError, match=r"times at row 2 \(from 0\) must be later than 0.1 \[s\], got 0.1"):
        motion_through([0.0, 0.1, 0.1], np.zeros((3, 6)))


def test_samples_that_go_on_for_hours_are_refused_before_they_fill_the_memory(tmp_path):
    with pytest.raises(
        InvalidValueError, match=r"duration: 1000000000\.0 s is more than 7200 s, .* check that times are in s"
    ):
        Motion.load_samples(file_of(tmp_path, "t,q1\n0,0.1\n1e9,0.2\n"))
    with pytest.raises(InvalidValueError, match="duration"):
        Motion.load_samples(file_of(tmp_path, "0.1\n0.2\n"), rate_hz=1e-6)


def test_times_that_are_probably_milliseconds_get_a_note(tmp_path):
    slow, fast = (
        file_of(tmp_path, "\n".join(f"{step * i},0,0.5,0,1,0,1,{1e-3 * i}" for i in range(30)), name)
        for step, name in ((1.0, "ms.csv"), (0.01, "s.csv"))
    )
    assert Motion.load(fast).notes == ()
    (note,) = Motion.load(slow).notes
    assert note.endswith("if the times are in ms, name their column t [ms]")
    with pytest.raises(InvalidValueError, match=r"pass max_rows=29001 .*; .* name their column t \[ms\]"):
        Motion.load(slow, max_rows=1000)


def test_the_csv_of_a_recorded_run_is_read_by_its_columns_t_and_q(tmp_path):
    run = some_run()
    run.save(tmp_path / "run.csv")
    motion = Motion.load_samples(tmp_path / "run.csv")
    assert motion.duration == pytest.approx(run.t[-1])
    assert np.abs(motion.q - run.q).max() < 1e-9
