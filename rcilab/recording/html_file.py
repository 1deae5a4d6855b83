"""A run as one HTML page with 3D, timeline and plots: it opens from a file, without network and without rcilab.

The page draws with WebGL and canvas by itself. viser and meshcat can write static pages, too, but theirs hold a bundled
three.js (0.8 to 1.1 MB), a scene only, and nothing that would move plots along with it; our arm is a few thousand
triangles, for which some pages of script are enough.
"""

from __future__ import annotations

import base64
import gzip
import html
import json
from importlib.resources import files
from typing import IO, TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rcilab.language import Language, load_words, require_language
from rcilab.robots.shapes import ROLE_COLORS, build_shapes
from rcilab.robots.upright import upright_flange, upright_joints

if TYPE_CHECKING:
    from rcilab.model import RobotModel
    from rcilab.recording.run import Run

_PATH_POINTS = 1200  # Of the drawn tool path; a choice.


def write_html(run: Run, stream: IO[bytes], language: str = "en") -> None:
    """Writes the page, its words in a language."""
    known = require_language(language)
    words = load_words("rcilab.recording", known)
    packed = _Packed()
    content = {
        "words": dict(words),
        "run": _pack_run(run, packed),
        "arm": None if run.model is None else _pack_arm(run.model, packed),
        "path": None if run.model is None else _pack_path(run, run.model, packed),
        "facts": _facts(run, known),
    }
    arm = words["title.unknown"] if run.model is None else words["title"].format(arm=run.model.name)
    assets = files("rcilab.recording") / "assets"
    page = (assets / "run.html").read_text(encoding="utf-8")
    parts = {
        "LANGUAGE": known,
        "TITLE": html.escape(arm),
        "STYLE": (assets / "run.css").read_text(encoding="utf-8"),
        "CONTENT": json.dumps(content, ensure_ascii=False).replace("</", "<\\/"),
        "ARRAYS": packed.as_text(),
        "SCENE": (assets / "scene.js").read_text(encoding="utf-8"),
        "PLOTS": (assets / "plots.js").read_text(encoding="utf-8"),
        "PAGE": (assets / "run.js").read_text(encoding="utf-8"),
    }
    for name, part in parts.items():
        page = page.replace(f"@@{name}@@", part)
    stream.write(page.encode())


class _Packed:
    """Arrays one after the other, compressed together; each is told by where it begins."""

    def __init__(self) -> None:
        self._parts: list[bytes] = []
        self._size = 0

    def add(self, array: NDArray[Any], kind: str = "<f4") -> dict[str, Any]:
        """Adds an array and returns how the page finds it."""
        flat = np.ascontiguousarray(array, dtype=kind)
        place = {"at": self._size, "count": int(flat.size), "kind": kind}
        content = flat.tobytes()
        content += bytes(-len(content) % 4)  # Typed arrays begin at whole words.
        self._parts.append(content)
        self._size += len(content)
        return place

    def as_text(self) -> str:
        """Returns everything as base64 of gzip."""
        return base64.b64encode(gzip.compress(b"".join(self._parts), 6, mtime=0)).decode("ascii")


def _pack_run(run: Run, packed: _Packed) -> dict[str, Any]:
    """Columns are laid one after the other: every signal of a joint is one piece."""
    tracking = run.tracking
    planned_rate = None
    if run.plan is not None:
        rows = np.clip(np.rint(run.t * 1e3).astype(np.intp) - run.delay, 0, len(run.plan.dq) - 1)
        planned_rate = run.plan.dq[rows]
    packs: dict[str, Any] = {
        "t": packed.add(run.t),
        "q": packed.add(np.degrees(run.q.T)),
        "dq": packed.add(np.degrees(run.dq.T)),
        "tau": packed.add(run.tau.T),
        "error": packed.add(np.degrees(tracking.joint.T)),
        "tool": packed.add(1000.0 * tracking.position),
        "fault": packed.add(run.cycles["faults"] != 0, "u1"),
    }
    if planned_rate is not None:
        packs |= {"q_plan": packed.add(np.degrees(run.planned.T)), "dq_plan": packed.add(np.degrees(planned_rate.T))}
    limits = None
    if run.model is not None:
        joint = run.model.limits.joint
        limits = {
            "q": [np.degrees(joint.lower).tolist(), np.degrees(joint.upper).tolist()],
            "dq": [(-np.degrees(joint.velocity)).tolist(), np.degrees(joint.velocity).tolist()],
            "tau": [(-joint.torque).tolist(), joint.torque.tolist()],
        }
    return {"n": run.q.shape[1], "arrays": packs, "limits": limits}


def _pack_arm(model: RobotModel, packed: _Packed) -> dict[str, Any]:
    shape = build_shapes(model.description, "coarse")
    meshes = []
    for link, body in enumerate((shape.base, *shape.links)):
        for part in body.parts:
            place = {"vertices": packed.add(part.mesh.vertices), "faces": packed.add(part.mesh.faces, "<u4")}
            meshes.append({"link": link, "color": [c / 255.0 for c in ROLE_COLORS[part.role]], **place})
    return {
        "meshes": meshes,
        "joints": [{"origin": j.origin.tolist(), "axis": j.axis.tolist()} for j in upright_joints(model.description)],
        "tool": (upright_flange(model.description) @ model.T_flange_tool).as_row_major(),
    }


def _pack_path(run: Run, model: RobotModel, packed: _Packed) -> dict[str, Any] | None:
    if len(run.q) < 2:
        return None
    rows = np.unique(np.linspace(0, len(run.q) - 1, min(_PATH_POINTS, len(run.q))).astype(np.intp))
    place: dict[str, Any] = {
        "points": packed.add(model.position_path(run.q[rows])),
        "error": packed.add(np.nan_to_num(1000.0 * run.tracking.position[rows])),
    }
    if run.plan is not None:
        place["plan"] = packed.add(model.position_path(run.planned[rows]))
    return place


def _facts(run: Run, language: Language) -> dict[str, Any]:
    """Rows of the two tables, in words."""
    words, tracking, timing, report = load_words("rcilab.recording", language), run.tracking, run.timing, run.report
    rms, largest = np.degrees(tracking.joint_rms), np.degrees(tracking.joint_max)
    errors = [[f"J{j + 1}", f"{rms[j]:.4f}°", f"{largest[j]:.4f}°"] for j in range(len(rms))]
    if run.model is not None:
        mm = [f"{1000.0 * value:.4f} mm" for value in (tracking.position_rms, tracking.position_max)]
        turn = [f"{np.degrees(value):.4f}°" for value in (tracking.rotation_rms, tracking.rotation_max)]
        errors += [[words["table.tool"], *mm], [words["table.turn"], *turn]]
    ended = words["facts.goal"]
    if run.faults:
        ended = words["facts.faulted"].format(faults=", ".join(fault.manual_name for fault in run.faults))
    elif not run.is_complete:
        ended = words["facts.cut"]
    elif run.stopped:
        ended = words["facts.stopped"].format(why=run.stopped)
    health = words["facts.lockstep"].format(lost=timing.lost)
    if run.realtime:
        health = words["facts.timing"].format(lost=timing.lost, late=timing.late, p99=timing.lateness_p99 * 1e6)
    target = " · ".join(part for part in (run.setup.target, run.setup.plant, run.setup.mode) if part)
    rows = [
        (words["facts.started"], run.setup.started),
        (words["facts.target"], target),
        (words["facts.duration"], words["facts.cycles"].format(duration=run.duration, cycles=len(run.cycles))),
        (words["facts.ended"], ended),
        (words["facts.health"], health),
        (words["facts.delay"], words["facts.delay_cycles"].format(delay=run.delay)),
    ]
    if report is not None:
        verdict = words["facts.violates"].format(count=len(report.violations))
        if report.ok:
            verdict = words["facts.conforms"].format(share=100.0 * report.worst.ratio, id=report.worst.id)
        rows.append((words["facts.check"], verdict))
    return {"errors": errors, "rows": [list(row) for row in rows if row[1]]}
