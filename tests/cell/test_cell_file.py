from __future__ import annotations

import json
import zipfile
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest

import rcilab
from rcilab.cell.cell import Cell
from rcilab.cell.cell_storage import read_uploaded
from rcilab.cell.entries import Frame, Obstacle, Signal
from rcilab.cell.mesh_file import load_mesh
from rcilab.cell.shapes import Box, Cylinder, Plane, Solid, Sphere
from rcilab.cell.tool import Jaws, Part, Tool
from rcilab.core.errors import InvalidValueError, VersionMismatchError
from rcilab.core.spatial import Pose
from rcilab.model.dynamics.payload import Payload

ROOT = Path(__file__).parents[2]
TETRAHEDRON = """solid part
facet normal 0 0 0
outer loop
vertex 0 0 0
vertex 0 100 0
vertex 100 0 0
endloop
endfacet
facet normal 0 0 0
outer loop
vertex 0 0 0
vertex 100 0 0
vertex 0 0 100
endloop
endfacet
facet normal 0 0 0
outer loop
vertex 0 0 0
vertex 0 0 100
vertex 0 100 0
endloop
endfacet
facet normal 0 0 0
outer loop
vertex 100 0 0
vertex 0 100 0
vertex 0 0 100
endloop
endfacet
endsolid part
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "part.stl").write_text(TETRAHEDRON)
    return tmp_path


def whole_cell(folder: Path) -> Cell:
    mesh = load_mesh(folder / "part.stl", scale=0.001)
    turned = Pose.from_rpy((0.1, 0.2, 0.3), (0.1, 0.2, 0.3))
    payload = Payload(mass=0.7, center_of_mass=(0.0, 0.01, 0.05), inertia=np.diag((1e-3, 2e-3, 2e-3)))
    finger = Solid(shape=Box(size=(0.02, 0.01, 0.05)), pose=Pose((0.0, 0.005, -0.025)))
    return Cell(
        name="Bench 3",
        model="xMatePro7",
        T_world_base=Pose((0.0, 0.0, 0.8)),
        floor=None,
        tool=Tool(
            name="gripper",
            T_flange_tool=turned,
            payload=payload,
            solids=(Solid(shape=mesh, pose=turned),),
            jaws=Jaws(open=0.08, closed=0.01, finger=(finger,)),
        ),
        frames=(Frame(name="table", T_parent_frame=turned), Frame(name="tray", parent="table")),
        obstacles=(
            Obstacle(name="top", shape=Box(size=(1.0, 0.8, 0.04)), pose=turned, may_touch=("part",)),
            Obstacle(name="post", shape=Cylinder(radius=0.05, length=1.0), frame="tray"),
            Obstacle(name="ball", shape=Sphere(radius=0.1)),
            Obstacle(name="wall", shape=Plane(), pose=turned),
            Obstacle(name="casting", shape=mesh),
        ),
        workpiece="casting",
        parts=(Part(name="bolt", payload=payload, T_tool_part=turned, solids=(Solid(shape=Sphere(radius=0.01)),)),),
        held="bolt",
        signals=(
            Signal(name="is closed", kind="input", channel=2),
            Signal(name="close", kind="output", channel=0),
        ),
    )


def test_a_cell_comes_back_from_its_file(folder: Path) -> None:
    cell = whole_cell(folder)
    cell.save(folder / "cell.json")
    again = Cell.load(folder / "cell.json")
    assert again.fingerprint == cell.fingerprint
    for name in ("name", "model", "floor", "workpiece", "held", "signals"):
        assert getattr(again, name) == getattr(cell, name)
    assert again.T_world("tray").is_close(cell.T_world("tray"), 1e-9)
    again.save(folder / "again.json")
    assert (folder / "again.json").read_text() == (folder / "cell.json").read_text()


def test_meshes_are_found_from_where_the_file_is(folder: Path) -> None:
    cell = whole_cell(folder)
    (folder / "cells").mkdir()
    cell.save(folder / "cells" / "cell.json")
    assert "../part.stl" in (folder / "cells" / "cell.json").read_text()
    assert Cell.load(folder / "cells" / "cell.json").fingerprint == cell.fingerprint


def test_an_archive_contains_the_meshes(folder: Path) -> None:
    cell = whole_cell(folder)
    cell.save(folder / "cell.zip")
    (folder / "part.stl").unlink()
    again = Cell.load(folder / "cell.zip")
    mesh, loaded = (next(o.shape for o in one.obstacles if o.name == "casting") for one in (cell, again))
    assert sorted(map(tuple, loaded.vertices.round(6).tolist())) == sorted(map(tuple, mesh.vertices.tolist()))
    assert again.T_world("tray").is_close(cell.T_world("tray"), 1e-9)
    with pytest.raises(InvalidValueError, match=r"as \.zip"):  # Its meshes belong to no file.
        again.save(folder / "cell.json")


def _archive(**entries: str) -> bytes:
    packed = BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        for name, content in entries.items():
            archive.writestr(name.replace("_", "."), content)
    return packed.getvalue()


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"not an archive", "not a ZIP archive"),
        (_archive(readme_txt="cell"), "contains no cell.json"),
        (_archive(cell_json="{"), "cell.zip, cell.json"),
        (
            _archive(
                cell_json='{"format": "rcilab cell", "version": 1, "model": "xMatePro7", "obstacles": '
                '[{"name": "a", "shape": "mesh", "file": "/etc/hostname.stl"}]}'
            ),
            "is not in cell.zip",
        ),
    ],
    ids=["no archive", "no cell", "no JSON", "no mesh"],  # Archives contain times, which differ between workers.
)
def test_a_wrong_archive_is_refused(content: bytes, said: str) -> None:
    with pytest.raises(InvalidValueError, match=said):
        read_uploaded(content, "cell.zip", Cell)


def test_a_damaged_archive_is_refused(folder: Path) -> None:
    whole_cell(folder).save(folder / "cell.zip")
    content = bytearray((folder / "cell.zip").read_bytes())
    for place in range(0, len(content), 7):
        damaged = bytes(content[:place]) + b"\xff" * 5 + bytes(content[place + 5 :])
        try:
            read_uploaded(damaged, "cell.zip", Cell)
        except (InvalidValueError, VersionMismatchError):
            continue


@pytest.fixture(scope="module")
def schema():
    import jsonschema  # Takes 2 s, which other workers need not wait for.

    content = json.loads((ROOT / "rcilab/cell/cell.schema.json").read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator.check_schema(content)
    return jsonschema.Draft202012Validator(content)


@pytest.mark.parametrize("name", ["pick_place", "machine_tending", "polishing"])
def test_an_example_is_free_at_home_and_fits_the_schema(schema, name: str) -> None:
    schema.validate(json.loads((ROOT / f"rcilab/cell/examples/{name}.json").read_text(encoding="utf-8")))
    example = Cell.example(name)
    for cell in (example, *(example.holding(part.name) for part in example.parts)):
        model = cell.applied_to(rcilab.load_model(cell.model))
        motion = rcilab.plan_joint(model, model.home, model.home + 1e-3)
        report = rcilab.check(motion, model, cell=cell)
        assert report.ok, str(report)


def test_a_written_cell_fits_the_schema_and_wrong_ones_do_not(schema, folder: Path) -> None:
    whole_cell(folder).save(folder / "cell.json")
    content = json.loads((folder / "cell.json").read_text())
    schema.validate(content)
    for obstacle in ({"name": "a", "shape": "sphere", "radius": 1.0, "size": [1, 1, 1]}, {"name": "a", "shape": "box"}):
        assert not schema.is_valid({**content, "obstacles": [obstacle]})


def test_an_unknown_example_is_named() -> None:
    with pytest.raises(InvalidValueError, match="there are: machine_tending, pick_place, polishing"):
        Cell.example("welding")


@pytest.mark.parametrize(
    ("change", "error", "said"),
    [
        ({"format": "x"}, InvalidValueError, "line 1, format.*must be 'rcilab cell'"),
        ({"version": 2}, VersionMismatchError, "version"),
        ({"walls": []}, InvalidValueError, "walls.*is unknown; known: .*obstacles"),
        ({"obstacles": [{"name": "a"}]}, InvalidValueError, "obstacles, entry 1, shape.*is missing"),
        ({"obstacles": [{"name": "a", "shape": "cube"}]}, InvalidValueError, "cube.*known: box, cylinder"),
        ({"obstacles": [{"name": "a", "shape": "box", "size": [1, 1]}]}, InvalidValueError, "line 1.*entry 1, size"),
        (
            {"obstacles": [{"name": "a", "shape": "plane", "radius": 1}]},
            InvalidValueError,
            "no meaning",
        ),
        (
            {"obstacles": [{"name": "a", "shape": "mesh", "file": "no.stl"}]},
            InvalidValueError,
            "no.stl.*cell.zip",
        ),
        ({"tool": {"mass": -1}}, InvalidValueError, "tool, load mass"),
        ({"model": "xMate9"}, Exception, "xMate9"),
        ({"held": "bolt"}, InvalidValueError, "line 1, held"),
    ],
)
def test_a_wrong_file_is_named_by_line_and_key(change: dict, error: type, said: str) -> None:
    content = {"format": "rcilab cell", "version": 1, "model": "xMatePro7", **change}
    with pytest.raises(error, match=said):
        read_uploaded(json.dumps(content).encode(), "cell.json", Cell)


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("a.step", b"", "must end in one of: .stl"),
        ("a.stl", b"not a mesh", "a.stl"),
        ("a.obj", b"v 0 0 0\n", "has no triangles|not a mesh"),
    ],
)
def test_what_is_not_a_mesh_is_refused(tmp_path: Path, name: str, content: bytes, said: str) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InvalidValueError, match=said):
        load_mesh(tmp_path / name)
