"""A run as one HTML page with 3D scene, timeline and plots that opens from a file, without network or rcilab.

The page draws with WebGL and canvas. viser and meshcat can write static pages too, but those contain a bundled three.js
(0.8 to 1.1 MB) and only a scene, without plots that move with it. The arm has a few thousand triangles, so a short
script is enough.
"""

from __future__ import annotations

import base64
import gzip
import html
import json
import re
from dataclasses import asdict, replace
from hashlib import sha256
from importlib.resources import files
from typing import IO, TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from rcilab.cell.shape_mesh import carried_solids, solid_mesh
from rcilab.core.clock import CYCLE_TIME
from rcilab.i18n.catalogue import load_catalogue
from rcilab.i18n.plot_scale import ERRORS, PlotScale, plot_scale
from rcilab.i18n.units import plain_number
from rcilab.recording.html_facts import fact_rows
from rcilab.recording.tracking_text import error_rows, tracking_notes
from rcilab.robots.shapes import ROLE_COLORS, build_shapes
from rcilab.robots.upright import upright_flange, upright_joints

if TYPE_CHECKING:
    from rcilab.cell.cell import Cell
    from rcilab.i18n.translator import Text
    from rcilab.model.robot_model import RobotModel
    from rcilab.recording.run import Run
    from rcilab.recording.tracking import Tracking

_PATH_POINTS = 1200  # Of the drawn tool path; tuning value: smooth at the size of a screen.
_COLORS = {"obstacle": (0.62, 0.66, 0.72), "tool": (0.30, 0.33, 0.38), "part": (0.90, 0.62, 0.25)}
_PLOTS = ("q", "dq", "tau", *ERRORS)


def write_html(run: Run, stream: IO[bytes], text: Text) -> None:
    """Writes the page in the language and the units of `text`."""
    tracking, has_torques = run.tracking, bool(np.isfinite(run.tau).any())
    packed, scales = _Packed(), {name: plot_scale(name, text.units) for name in _PLOTS}
    content = {
        "words": _texts(run, text),
        "run": _pack_run(run, tracking, scales, packed),
        "charts": [_chart(name, scale, text, run) for name, scale in scales.items() if name != "tau" or has_torques],
        "arm": None if run.model is None else _pack_arm(run.model, run.cell, packed),
        "path": None if run.model is None else _pack_path(run, run.model, tracking, scales["tool"], packed),
        "facts": {
            "errors": error_rows(run, tracking, text),
            "head": {"rms": text("tracking.rms"), "max": text("tracking.max")},
            "notes": tracking_notes(run, tracking, text) + ([] if has_torques else [text("plot.no_tau")]),
            "rows": fact_rows(run, text),
        },
    }
    arm = text("title.unknown") if run.model is None else text("title", arm=run.model.name)
    assets = files("rcilab.recording") / "assets"
    page, style, scene, plots, script = (
        (assets / name).read_text(encoding="utf-8")
        for name in ("run.html", "run.css", "scene.js", "plots.js", "run.js")
    )
    parts = {
        "LANGUAGE": text.language,
        "TITLE": html.escape(arm),
        "STYLE": style,
        "CONTENT": json.dumps(content, ensure_ascii=False).replace("<", r"\u003c"),
        "ARRAYS": packed.as_text(),
        "SCENE": scene,
        "PLOTS": plots,
        "PAGE": script,
        "SCRIPTS": " ".join(f"'sha256-{_digest(part)}'" for part in (scene, plots, script)),
    }
    # In one pass, so that no part is inserted into another part.
    stream.write(re.sub(r"@@(\w+)@@", lambda found: parts[found[1]], page).encode())


def _digest(script: str) -> str:
    """Returns the hash of a script for the page's content security policy, which allows no other scripts."""
    return base64.b64encode(sha256(script.encode()).digest()).decode("ascii")


class _Packed:
    """Concatenated arrays, compressed together; each is referred to by its offset."""

    def __init__(self) -> None:
        self._parts: list[bytes] = []
        self._size = 0

    def add(self, array: NDArray[Any], kind: str = "<f4") -> dict[str, Any]:
        """Adds an array and returns its reference for the page."""
        flat = np.ascontiguousarray(array, dtype=kind)
        reference = {"at": self._size, "count": int(flat.size), "kind": kind}
        content = flat.tobytes()
        content += bytes(-len(content) % 4)  # Typed arrays start at multiples of 4 bytes.
        self._parts.append(content)
        self._size += len(content)
        return reference

    def as_text(self) -> str:
        """Returns all arrays as base64 of gzip."""
        return base64.b64encode(gzip.compress(b"".join(self._parts), 6, mtime=0)).decode("ascii")


def _texts(run: Run, text: Text) -> dict[str, str]:
    """Returns the texts of the page; those for a run without a plan name the commands as reference."""
    texts = dict(load_catalogue("rcilab.recording", text.language))
    if run.plan is None:
        texts |= {name: texts[f"{name}_commanded"] for name in ("path", "table.title")}
    return texts


def _chart(name: str, scale: PlotScale, text: Text, run: Run) -> dict[str, Any]:
    key = f"plot.{name}_commanded" if run.plan is None and name in ERRORS else f"plot.{name}"
    return {"name": name, "title": text(key), **asdict(scale), "digits": scale.digits}


def _pack_run(run: Run, tracking: Tracking, scales: dict[str, PlotScale], packed: _Packed) -> dict[str, Any]:
    """Packs the signals in the units of the plots, column by column: each signal of a joint is contiguous."""
    factor = {name: scale.factor for name, scale in scales.items()}
    packs: dict[str, Any] = {
        "t": packed.add(run.t),
        "q": packed.add(factor["q"] * run.q.T),
        "dq": packed.add(factor["dq"] * run.dq.T),
        "tau": packed.add(run.tau.T),
        "error": packed.add(factor["error"] * tracking.joint.T),
        "tool": packed.add(factor["tool"] * tracking.position),
        "fault": packed.add(run.cycles["faults"] != 0, "u1"),
    }
    if run.plan is not None:
        # Backward differences, as in the controller.
        velocity = np.diff(run.plan.q, axis=0, prepend=run.plan.q[:1]) / CYCLE_TIME
        rows = np.clip(np.rint(run.t / CYCLE_TIME).astype(np.intp) - run.delay, 0, len(velocity) - 1)
        packs["q_plan"] = packed.add(factor["q"] * run.planned.T)
        packs["dq_plan"] = packed.add(factor["dq"] * velocity[rows].T)
    limits = None
    if run.model is not None:
        joint = run.model.limits.joint.in_mode(run.setup.mode)
        bounds: dict[str, tuple[NDArray[Any], NDArray[Any]]] = {
            "q": (joint.lower, joint.upper),
            "dq": (-joint.velocity, joint.velocity),
            "tau": (-joint.torque, joint.torque),
        }
        limits = {name: [(factor[name] * side).tolist() for side in pair] for name, pair in bounds.items()}
        if joint.near_ends is not None:
            lowest, highest = joint.velocity_bounds(run.q_c)
            packs["dq_lowest"] = packed.add(factor["dq"] * lowest.T)
            packs["dq_highest"] = packed.add(factor["dq"] * highest.T)
    return {"n": run.q.shape[1], "arrays": packs, "limits": limits}


def _pack_arm(model: RobotModel, cell: Cell | None, packed: _Packed) -> dict[str, Any]:
    shape = build_shapes(model.description, "coarse")
    meshes = []
    for link, body in enumerate((shape.base, *shape.links)):
        for part in body.parts:
            arrays = {"vertices": packed.add(part.mesh.vertices), "faces": packed.add(part.mesh.faces, "<u4")}
            meshes.append({"link": link, "color": [c / 255.0 for c in ROLE_COLORS[part.role]], **arrays})
    if cell is not None:
        meshes += _pack_cell(model, cell, packed)
    return {
        "meshes": meshes,
        "floor": (None if cell is None else cell.floor_height) or 0.0,
        "joints": [{"origin": j.origin.tolist(), "axis": j.axis.tolist()} for j in upright_joints(model.description)],
        "tool": (upright_flange(model.description) @ model.T_flange_tool).as_row_major(),
    }


def _pack_cell(model: RobotModel, cell: Cell, packed: _Packed) -> list[dict[str, Any]]:
    """Returns the obstacles, and on the last link the tool and the held part; each triangle with corners of its own."""
    T_link_flange = upright_flange(model.description)
    found = [(0, "obstacle", cell.solid(obstacle.name)) for obstacle in cell.obstacles]
    for name, solids in carried_solids(cell, model.T_flange_tool).items():
        found += [(model.n, name, replace(solid, pose=T_link_flange @ solid.pose)) for solid in solids]
    meshes: list[dict[str, Any]] = []
    for link, name, solid in found:
        mesh = solid_mesh(solid)
        corners = mesh.vertices[mesh.faces].reshape(-1, 3)
        arrays = {"vertices": packed.add(corners), "faces": packed.add(np.arange(len(corners)), "<u4")}
        meshes.append({"link": link, "color": _COLORS[name], "casts": name != "obstacle", **arrays})
    return meshes


def _pack_path(
    run: Run, model: RobotModel, tracking: Tracking, scale: PlotScale, packed: _Packed
) -> dict[str, Any] | None:
    if len(run.q) < 2:
        return None
    rows = np.unique(np.linspace(0, len(run.q) - 1, min(_PATH_POINTS, len(run.q))).astype(np.intp))
    error = scale.factor * tracking.position[rows]
    worst = max(float(np.nanmax(error, initial=0.0)), scale.least)
    path: dict[str, Any] = {
        "points": packed.add(model.position_path(run.q[rows])),
        "error": packed.add(error),
        "worst": worst,
        "worst_text": scale.with_unit(plain_number(worst, 2)),
    }
    if run.plan is not None:
        path["plan"] = packed.add(model.position_path(run.planned[rows]))
    return path
