"""G-code of milling, laser and printing programs as moves of the tool, by RS274/NGC (NIST, 2000).

What a machine does besides moving its tool, spindle or coolant, is ignored with a note. What would change the path in a
way that is not known here, offsets of the machine, cutter compensation, cycles, variables, is refused.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator
from itertools import islice

from rcilab.core.arrays import Unquoted
from rcilab.core.errors import InvalidValueError
from rcilab.i18n.translator import Remark
from rcilab.motion.path import Point
from rcilab.motion.path_move import ArcMove, PathMove
from rcilab.motion.waypoint import require_count
from rcilab.motion.waypoint_types import MOST_WAYPOINTS

_WORD = re.compile(r"([A-Z])([+-]?(?:\d+\.?\d*|\.\d+))")
_PROGRAMMED = re.compile(r"[A-Z]?[#\[<]|M0*9[89](?!\d)")
_COMMENT = re.compile(r"\([^()]*\)|;.*")
_MILLIMETRE, _INCH = 0.001, 0.0254  # [m]
_AXES = "XYZ"
_PLANES = {17.0: (0, 1, 2), 18.0: (2, 0, 1), 19.0: (1, 2, 0)}
"""Indices of the two axes of a plane and of its normal, right-handed."""
_MOTIONS = {0.0: "rapid", 1.0: "line", 2.0: "clockwise", 3.0: "counterclockwise"}
_SILENT = frozenset({40.0, 49.0, 80.0, 94.0})
"""G words that are the state of this reader: no compensation, no cycle, feed per minute."""
_IGNORED = frozenset({43.0, 54.0, 61.0, 64.0, 96.0, 97.0, 98.0, 99.0})
_MACHINE = frozenset({10, 28, 30, 53, 55, 56, 57, 58, 59, 92})
_COMPENSATION = frozenset({41, 42})
_CYCLES = frozenset({73, 76, *range(81, 90)})
_FEED_MODES = frozenset({93, 95})
_END = (2.0, 30.0)
_SUBPROGRAM = "is a subprogram or a variable; have the CAM program write plain moves"
_SAME_RADIUS = 1e-5, 1e-3
"""Largest difference between the radii at start and end of an arc, [m] and as a part of the radius: rounding."""
_LARGEST = 1e9  # Number of a word; no machine has larger ones.
_HELIX_SAGITTA = 1e-5  # [m] Tuning value: largest distance of the chords of a helix from it.
_FULL_TURN = 1e-9  # [m] An arc that ends this close to its start is a full circle.
_SHORTEST = 1e-9  # [m] A shorter move is none.


def read_gcode(content: bytes, name: str) -> tuple[list[PathMove], list[Remark]]:
    """Returns the moves of a program in G-code, and notes on what is ignored.

    Args:
        content: The text, UTF-8 or Latin-1.
        name: Name of the file, for errors.

    Raises:
        InvalidValueError: A line is not understood; the message names file, line, value and remedy.
    """
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = content.decode("latin-1")  # Comments of older CAM programs.
    reader = _Reader(name, set(_COMMENT.sub("", text).upper()))
    for number, line in enumerate(text.splitlines(), 1):
        if not reader.read(number, _words(line, name, number)):
            break
    return reader.moves, reader.notes()


def _words(line: str, name: str, number: int) -> list[tuple[str, float]]:
    """Returns the words of a line without its comments."""
    text = re.sub(r"\s", "", _COMMENT.sub("", line)).upper()
    if text.startswith("%"):
        return []
    where = f"{name}, line {number}"
    if text.startswith("/"):
        problem = "is a line that machines may skip; remove it, or its slash"
        raise InvalidValueError(where, line.strip(), problem).coded("gcode_slash")
    words: list[tuple[str, float]] = []
    at = 0
    while at < len(text):
        if _PROGRAMMED.match(text, at):
            raise InvalidValueError(where, text[at:], _SUBPROGRAM).coded("gcode_subprogram")
        match = _WORD.match(text, at)
        if match is None:
            problem = "is not a word of G-code; a word is a letter and a number, such as X1.5"
            raise InvalidValueError(where, text[at:], problem).coded("gcode_word")
        value = float(match[2])
        if abs(value) > _LARGEST:
            raise InvalidValueError(where, match[0], f"has a number beyond {_LARGEST:g}").coded(
                "gcode_large", most=f"{_LARGEST:g}"
            )
        words.append((match[1], value))
        at = match.end()
    return words


class _Reader:
    """The state of a program from line to line. Owned by one call of `read_gcode`."""

    def __init__(self, name: str, letters: set[str]) -> None:
        self.moves: list[PathMove] = []
        self._name = name
        self._where = name
        self._ignored: dict[str, list[int]] = {}
        self._unit, self._plane, self._motion = _MILLIMETRE, _PLANES[17.0], ""
        self._is_relative = self._has_absolute_centers = False
        self._feed: float | None = None
        # An axis that the file never names stays at 0; the others are unknown at first.
        self._position: list[float | None] = [None if axis in letters else 0.0 for axis in _AXES]

    def notes(self) -> list[Remark]:
        """Returns one note for each kind of word that was ignored."""
        return [_ignored(self._name, word, lines) for word, lines in self._ignored.items()]

    def read(self, line: int, words: list[tuple[str, float]]) -> bool:
        """Takes the words of a line; returns whether the program continues."""
        self._where = f"{self._name}, line {line}"
        given: dict[str, float] = {}
        codes: list[float] = []
        ends = False
        for letter, value in words:
            if letter == "G":
                codes.append(value)
            elif letter == "M":
                ends = ends or value in _END
                if value not in _END:
                    self._ignore(f"M{value:g}", line)
            elif letter in "ABCUVW":
                problem = "moves an axis that a path of the tool does not have; remove it"
                raise self._error(f"{letter}{value:g}", problem).coded("gcode_axis")
            elif letter in "STHDELQ":
                self._ignore(letter, line)
            elif letter in given:
                raise self._error(f"{letter}{value:g}", f"is a second {letter} in this line; keep one").coded(
                    "gcode_twice"
                )
            elif letter not in "NO":
                given[letter] = value
        is_dwell = self._set_modes(line, codes)
        if "F" in given:
            self._set_feed(given["F"])
        if is_dwell:
            self._dwell(given)
        elif any(letter in given for letter in "XYZIJKR"):
            self._move(line, given)
        return not ends

    def _set_modes(self, line: int, codes: Iterable[float]) -> bool:
        """Takes the G words; returns whether there is a dwell."""
        motions: list[float] = []
        is_dwell = False
        for code in codes:
            if code in _MOTIONS:
                motions.append(code)
            elif code in _PLANES:
                self._plane = _PLANES[code]
            elif code in (20.0, 21.0):
                self._unit = _INCH if code == 20.0 else _MILLIMETRE
            elif code in (90.0, 91.0):
                self._is_relative = code == 91.0
            elif code in (90.1, 91.1):
                self._has_absolute_centers = code == 90.1
            elif code == 4.0:
                is_dwell = True
            elif math.floor(code) in _IGNORED:
                self._ignore(f"G{code:g}", line)
            elif code not in _SILENT:
                raise self._refusal(code)
        if len(motions) > 1:
            raise self._error(f"G{motions[1]:g}", "is a second motion in this line; keep one").coded("gcode_twice")
        if motions:
            self._motion = _MOTIONS[motions[0]]
        return is_dwell

    def _refusal(self, code: float) -> InvalidValueError:
        """Returns the error for a G word that would change the path in a way that is not known here."""
        number, word = math.floor(code), f"G{code:g}"
        if number in _MACHINE:
            problem = (
                "refers to coordinates of the machine, which are unknown here; remove it, and give the path a frame"
            )
            return self._error(word, problem).coded("gcode_machine")
        if number in _COMPENSATION:
            problem = "is cutter compensation; have the CAM program write the path of the centre"
            return self._error(word, problem).coded("gcode_compensation")
        if number in _CYCLES:
            problem = "is a canned cycle; have the CAM program write single moves"
            return self._error(word, problem).coded("gcode_cycle")
        if number in _FEED_MODES:
            return self._error(word, "is another kind of feed; use G94, feed per minute").coded("gcode_feed_mode")
        problem = "is unknown; known: G0 to G4, G17 to G21, G90, G91; remove it if it does not change the path"
        return self._error(word, problem).coded("gcode_unknown")

    def _set_feed(self, feed: float) -> None:
        if feed <= 0.0:
            raise self._error(f"F{feed:g}", "must be above 0: the feed per minute").coded("gcode_feed")
        self._feed = feed * self._unit / 60.0

    def _dwell(self, given: dict[str, float]) -> None:
        time = given.get("P", given.get("X", 0.0))
        if time < 0.0:
            raise self._error(f"P{time:g}", "must be 0 or more: the dwell in seconds").coded("gcode_dwell")
        if self.moves:
            self.moves[-1] = self.moves[-1].with_dwell(time)

    def _move(self, line: int, given: dict[str, float]) -> None:
        if not self._motion:
            problem = "has no motion; begin with G0, G1, G2 or G3"
            words = " ".join(f"{letter}{value:g}" for letter, value in given.items())
            raise self._error(words, problem).coded("gcode_no_motion")
        before = list(self._position)
        for axis, letter in enumerate(_AXES):
            if letter not in given:
                continue
            value, here = given[letter] * self._unit, self._position[axis]
            if self._is_relative and here is None:
                raise self._error(f"{letter}{given[letter]:g}", _NO_START).coded("gcode_no_start")
            self._position[axis] = value + here if self._is_relative and here is not None else value
        start, goal = _known(before), _known(self._position)
        is_arc = self._motion in ("clockwise", "counterclockwise")
        if is_arc and (start is None or goal is None):
            raise self._error("G2" if self._motion == "clockwise" else "G3", _NO_START).coded("gcode_no_start")
        if goal is None:
            return  # The path begins where all its coordinates are given.
        feed = None if self._motion == "rapid" else self._feed
        if is_arc:
            assert start is not None
            self.moves += islice(self._arc(line, start, goal, given, feed), MOST_WAYPOINTS + 1)
        elif not self.moves or start is None or math.dist(start, goal) > _SHORTEST:
            self.moves.append(PathMove(line=line, position=goal, feed=feed))
        if len(self.moves) > MOST_WAYPOINTS:  # Before a large file fills the memory.
            require_count(len(self.moves))

    def _arc(
        self, line: int, start: Point, goal: Point, given: dict[str, float], feed: float | None
    ) -> Iterator[PathMove]:
        if given.get("P", 1.0) != 1.0:
            raise self._error(f"P{given['P']:g}", "turns are too many; give each turn a line of its own").coded(
                "gcode_turns"
            )
        if not self.moves:
            self.moves.append(PathMove(line=line, position=start, feed=None))
        center, angle = self._circle(start, goal, given)
        first, second, normal = self._plane
        a = start[first] - center[0], start[second] - center[1]
        b = goal[first] - center[0], goal[second] - center[1]
        radius, end = math.hypot(*a), math.hypot(*b)
        begin = math.atan2(a[1], a[0])
        rise = goal[normal] - start[normal]

        def point(share: float) -> Point:
            distance, turned = radius + share * (end - radius), begin + share * angle
            place = [0.0, 0.0, 0.0]
            place[first] = center[0] + distance * math.cos(turned)
            place[second] = center[1] + distance * math.sin(turned)
            place[normal] = start[normal] + share * rise
            return place[0], place[1], place[2]

        if abs(rise) > _SHORTEST:  # No waypoint is a helix.
            step = min(2.0 * math.sqrt(2.0 * _HELIX_SAGITTA / radius), 0.5 * math.pi)
            count = max(math.ceil(abs(angle) / step), 1)
            yield from (PathMove(line=line, position=point(i / count), feed=feed) for i in range(1, count))
            yield PathMove(line=line, position=goal, feed=feed)
            return
        middle, axis = [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]
        middle[first], middle[second], middle[normal] = center[0], center[1], start[normal]
        axis[normal] = math.copysign(1.0, angle)
        arc = ArcMove(
            via=point(0.5), center=(middle[0], middle[1], middle[2]), axis=(axis[0], axis[1], axis[2]),
            angle=abs(angle), radius=radius,
        )  # fmt: skip
        yield PathMove(line=line, position=goal, feed=feed, arc=arc)

    def _circle(self, start: Point, goal: Point, given: dict[str, float]) -> tuple[tuple[float, float], float]:
        """Returns the centre in the plane, [m], and the angle, [rad], negative for a clockwise arc."""
        first, second, _ = self._plane
        a, b = (start[first], start[second]), (goal[first], goal[second])
        sign = -1.0 if self._motion == "clockwise" else 1.0
        offsets = [given.get("IJK"[axis]) for axis in (first, second)]
        if "R" in given:
            if any(offset is not None for offset in offsets):
                raise self._error(f"R{given['R']:g}", "is given with a centre, I J K; keep one of them").coded(
                    "gcode_center"
                )
            return self._by_radius(a, b, given["R"] * self._unit, sign)
        if offsets == [None, None] or (self._has_absolute_centers and None in offsets):
            problem = "is an arc without centre; give I, J, K or R in the plane that is chosen (G17, G18, G19)"
            raise self._error("G2" if sign < 0.0 else "G3", problem).coded("gcode_no_center")
        shift = [0.0 if offset is None else offset * self._unit for offset in offsets]
        center = (shift[0], shift[1]) if self._has_absolute_centers else (a[0] + shift[0], a[1] + shift[1])
        radii = math.dist(a, center), math.dist(b, center)
        if abs(radii[1] - radii[0]) > max(_SAME_RADIUS[0], _SAME_RADIUS[1] * radii[0]) or min(radii) < _SHORTEST:
            begin, end = (f"{1e3 * radius:.5g} mm" for radius in radii)
            problem = f"is the radius at the end of the arc, but that at its start is {begin}"
            raise self._error(Unquoted(end), problem).coded("gcode_radius", start=begin)
        if math.dist(a, b) < _FULL_TURN:
            return center, sign * math.tau
        turned = [math.atan2(place[1] - center[1], place[0] - center[0]) for place in (a, b)]
        return center, sign * ((sign * (turned[1] - turned[0])) % math.tau)

    def _by_radius(
        self, a: tuple[float, float], b: tuple[float, float], radius: float, sign: float
    ) -> tuple[tuple[float, float], float]:
        chord = math.dist(a, b)
        if chord < _SHORTEST:
            problem = "gives no circle for an arc that ends at its start; give the centre, I J K"
            raise self._error(f"R{radius / self._unit:g}", problem).coded("gcode_no_circle")
        half = 0.5 * chord / abs(radius) if radius else math.inf
        if half > 1.0 + _SAME_RADIUS[1]:
            least = f"{0.5 * chord / self._unit:.4g}"
            problem = f"is too small: the arc needs at least {least}"
            raise self._error(f"R{radius / self._unit:g}", problem).coded("gcode_small", least=least)
        angle = 2.0 * math.asin(min(half, 1.0))
        angle = math.tau - angle if radius < 0.0 else angle  # By RS274/NGC: the larger arc.
        height = 0.5 * chord / math.tan(0.5 * angle) * sign
        along = (b[0] - a[0]) / chord, (b[1] - a[1]) / chord
        center = (
            0.5 * (a[0] + b[0]) - height * along[1],
            0.5 * (a[1] + b[1]) + height * along[0],
        )
        return center, sign * angle

    def _ignore(self, word: str, line: int) -> None:
        self._ignored.setdefault(word, []).append(line)

    def _error(self, value: object, problem: str) -> InvalidValueError:
        return InvalidValueError(self._where, value, problem)


_NO_START = "needs a start: give X, Y and Z, absolute (G90), in a line with G0 or G1 before it"


def _known(position: list[float | None]) -> Point | None:
    x, y, z = position
    return None if x is None or y is None or z is None else (x, y, z)


def _ignored(name: str, word: str, lines: list[int]) -> Remark:
    text = f"{name}, line {lines[0]}: {word} is ignored, as it does not move the tool"
    if len(lines) == 1:
        return Remark(text, "path_ignored", file=name, line=lines[0], word=word)
    return Remark(
        f"{text} ({len(lines)} lines)", "path_ignored_lines", file=name, line=lines[0], word=word, count=len(lines)
    )  # fmt: skip
