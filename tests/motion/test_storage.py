import io
import warnings

import numpy as np
import pytest

from rcilab.core.errors import InvalidValueError, RcilabError, VersionMismatchError
from rcilab.model.robot_model import load_model
from rcilab.motion import Motion, plan_joint
from rcilab.motion.storage import KIND, VERSION

MODEL = load_model("xMate3")
MOTION = plan_joint(MODEL, MODEL.home, MODEL.home + 0.3, speed=0.7)


def fields(**changes: object) -> dict[str, object]:
    good = {
        "kind": KIND,
        "version": VERSION,
        "law": "jerk_limited",
        "speed": 0.7,
        "breaks": MOTION.polynomial.breaks,
        "coefficients": MOTION.polynomial.coefficients,
        "goal": MOTION.goal,
    }
    return {name: value for name, value in (good | changes).items() if value is not None}


@pytest.mark.parametrize("law", ["jerk_limited", "s_profile"])
def test_load_after_save_is_the_same_motion_to_the_last_bit(tmp_path, law):
    motion = plan_joint(MODEL, MODEL.home, MODEL.home + 0.3, law=law)
    motion.save(tmp_path / "a.npz")
    again = Motion.load(str(tmp_path / "a.npz"))
    assert again.fingerprint == motion.fingerprint
    assert np.array_equal(again.q, motion.q)
    assert again.law == law


def test_a_motion_goes_through_a_stream():
    stream = io.BytesIO()
    MOTION.save(stream)
    stream.seek(0)
    assert Motion.load(stream).fingerprint == MOTION.fingerprint


@pytest.mark.parametrize(
    ("changes", "word"),
    [
        ({"kind": "holiday photos"}, "does not contain a motion"),
        ({"kind": None}, "does not contain a motion"),
        ({"goal": None}, "incomplete"),
        ({"speed": 3.0}, "speed"),
        ({"law": "teleport"}, "law"),
        ({"goal": np.full(6, np.nan)}, "finite"),
        ({"goal": np.zeros(7)}, "goal"),
        ({"breaks": np.array([0.0, np.nan])}, "damaged|shapes"),
        ({"coefficients": np.zeros(3)}, "shapes"),
        ({"coefficients": np.array([["a"]])}, "damaged"),
        ({"speed": np.array([1.0, 2.0])}, "damaged"),
        ({"goal": MOTION.goal + 0j}, "do not all contain real numbers"),
        ({"segment_starts": np.array(["a"])}, "do not all contain real numbers"),
    ],
)
def test_a_file_that_holds_no_sound_motion_is_refused_in_words(tmp_path, changes, word):
    np.savez(tmp_path / "x.npz", **fields(**changes))
    with pytest.raises(InvalidValueError, match=word):
        Motion.load(tmp_path / "x.npz")


@pytest.mark.parametrize("version", [VERSION + 1, 0, None, [1, 2]])
def test_another_version_is_named(tmp_path, version):
    np.savez(tmp_path / "x.npz", **fields(version=version))
    with pytest.raises(VersionMismatchError, match=f"need {VERSION}"):
        Motion.load(tmp_path / "x.npz")


@pytest.mark.parametrize("content", [b"", b"hello", b"PK\x03\x04 broken", b"\x93NUMPY\x01\x00"])
def test_bytes_that_are_no_archive_are_refused(tmp_path, content):
    (tmp_path / "x.npz").write_bytes(content)
    with pytest.raises(InvalidValueError, match=r"x\.npz.*cannot be read"):
        Motion.load(tmp_path / "x.npz")


def test_a_cut_file_is_refused_wherever_it_is_cut(tmp_path):
    MOTION.save(tmp_path / "x.npz")
    whole = (tmp_path / "x.npz").read_bytes()
    for length in range(0, len(whole), len(whole) // 40):
        (tmp_path / "x.npz").write_bytes(whole[:length])
        with pytest.raises(RcilabError):
            Motion.load(tmp_path / "x.npz")


def test_one_flipped_byte_never_gives_another_motion_silently(tmp_path):
    MOTION.save(tmp_path / "x.npz")
    whole = bytearray((tmp_path / "x.npz").read_bytes())
    rng = np.random.default_rng(7)
    for place in rng.integers(0, len(whole), 150):
        damaged = bytearray(whole)
        damaged[place] ^= 0x10
        (tmp_path / "x.npz").write_bytes(damaged)
        try:
            assert Motion.load(tmp_path / "x.npz").fingerprint == MOTION.fingerprint
        except RcilabError:
            pass


@pytest.mark.parametrize("compressed", [False, True])
def test_whatever_is_damaged_is_refused_in_our_words_and_nothing_else_escapes(compressed):
    stream = io.BytesIO()
    (np.savez_compressed if compressed else np.savez)(stream, **fields())
    whole, rng = stream.getvalue(), np.random.default_rng(8)
    for _ in range(200):
        damaged = bytearray(whole)
        places = rng.integers(0, len(whole), rng.integers(1, 4))
        if rng.random() < 0.5:  # Where the headers and the table of contents are.
            places = np.where(rng.random(len(places)) < 0.5, places % 200, len(whole) - 1 - places % 700)
        for place in places:
            damaged[place] = rng.integers(0, 256)
        try:
            with warnings.catch_warnings(action="ignore"):  # Of zipfile, on names that come twice.
                assert Motion.load(io.BytesIO(bytes(damaged))).fingerprint == MOTION.fingerprint
        except RcilabError:
            pass


def test_a_mistake_of_ours_is_not_taken_for_a_damaged_file(monkeypatch):
    def slip(*_: object, **__: object) -> None:
        raise AttributeError("a mistake in the code")

    stream = io.BytesIO()
    MOTION.save(stream)
    stream.seek(0)
    monkeypatch.setattr(np, "load", slip)
    with pytest.raises(AttributeError, match="a mistake in the code"):
        Motion.load(stream)


def test_a_single_array_and_pickles_are_refused(tmp_path):
    np.save(tmp_path / "x.npy", np.zeros(3))
    with pytest.raises(InvalidValueError, match="single array"):
        Motion.load(tmp_path / "x.npy")
    np.savez(tmp_path / "y.npz", kind=np.array([{}], dtype=object))
    with pytest.raises(InvalidValueError, match="cannot be read"):
        Motion.load(tmp_path / "y.npz")


def test_a_file_of_another_kind_is_named_with_the_function_that_loads_it(tmp_path):
    for name, function in (("a.rcirun", r"rcilab\.load_run"), ("a.json", r"Program\.load")):
        (tmp_path / name).write_text("{}")
        with pytest.raises(InvalidValueError, match=function):
            Motion.load(tmp_path / name)


def test_missing_and_unwritable_files_are_named(tmp_path):
    with pytest.raises(InvalidValueError, match=r"nothing\.npz.*does not exist"):
        Motion.load(tmp_path / "nothing.npz")
    with pytest.raises(InvalidValueError, match="cannot be written"):
        MOTION.save(tmp_path / "no" / "such" / "folder.npz")
    with pytest.raises(InvalidValueError, match="cannot be read"):
        Motion.load(tmp_path)


def test_no_text_of_numpy_or_zip_reaches_the_user(tmp_path):
    contents = [b"", b"hello", b"PK\x03\x04 broken"]
    np.savez(tmp_path / "pickle.npz", kind=np.array([{}], dtype=object))
    np.savez(tmp_path / "speeds.npz", **fields(speed=np.array([1.0, 2.0])))
    contents += [(tmp_path / name).read_bytes() for name in ("pickle.npz", "speeds.npz")]
    for content in contents:
        with pytest.raises(InvalidValueError) as caught:
            Motion.load(io.BytesIO(content))
        assert not any(word in str(caught.value) for word in ("pickle", "zip", "dimensional", "EOF"))


def test_another_version_says_what_to_do_with_the_file(tmp_path):
    np.savez(tmp_path / "x.npz", **fields(version=VERSION + 1))
    with pytest.raises(VersionMismatchError, match="plan and save the motion again") as caught:
        Motion.load(tmp_path / "x.npz")
    assert "both sides" not in str(caught.value)


@pytest.mark.parametrize("file", [None, 3])
def test_what_is_no_file_is_refused_in_words(file):
    with pytest.raises(InvalidValueError, match="must be a file name"):
        MOTION.save(file)
    with pytest.raises(InvalidValueError, match="must be a file name"):
        Motion.load(file)


def test_a_motion_saved_as_csv_comes_back_with_the_same_rows(tmp_path):
    MOTION.save(tmp_path / "m.csv")
    again = Motion.load(tmp_path / "m.csv")
    assert np.array_equal(again.q, MOTION.q)
    assert np.array_equal(again.times, MOTION.times)
    assert (tmp_path / "m.csv").read_text().startswith("t [s],q1 [rad],q2 [rad]")


def test_an_unknown_ending_of_a_motion_is_refused_with_the_known_ones(tmp_path):
    with pytest.raises(InvalidValueError, match=r"must end in \.npz or \.csv"):
        MOTION.save(tmp_path / "m.txt")
    assert not list(tmp_path.iterdir())


def test_samples_say_their_rate():
    rows = MOTION.q[::10]
    assert Motion.from_samples(rows, dt=0.01).duration == pytest.approx(0.01 * (len(rows) - 1))
    assert Motion.from_samples(rows, times=0.02 * np.arange(len(rows))).duration == pytest.approx(
        0.02 * (len(rows) - 1)
    )
    with pytest.raises(InvalidValueError, match=r"^dt is missing: pass the seconds .* use Motion\.from_cycles$"):
        Motion.from_samples(rows)
    with pytest.raises(InvalidValueError, match=r"^dt: 0\.01 is not needed"):
        Motion.from_samples(rows, dt=0.01, times=[0.0])
    with pytest.raises(InvalidValueError, match="above 0"):
        Motion.from_samples(rows, dt=0.0)
