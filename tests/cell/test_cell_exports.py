"""A cell in the exports: obstacles, tool and held part in MJCF, HTML page, MCAP and the file of a run."""

from __future__ import annotations

import base64
import gzip
import io
import json
from dataclasses import replace
from pathlib import Path

import mujoco
import numpy as np
import pytest

import rcilab
from rcilab.cell.cell import Cell
from rcilab.cell.entries import Obstacle
from rcilab.cell.shape_mesh import shape_mesh, solid_mesh
from rcilab.cell.shapes import Box, Cylinder, MeshShape, Plane, Solid, Sphere
from rcilab.cell.tool import Part, Tool
from rcilab.cli import main
from rcilab.core.spatial import Pose
from rcilab.model.dynamics.payload import Payload
from rcilab.recording.run import build_run, load_run
from tests.recording.runs import PLAN, SETUP, export_run, some_cycles

WEDGE = MeshShape(
    vertices=np.array([(0, 0, 0), (0.1, 0, 0), (0, 0.1, 0), (0, 0, 0.1)], dtype=float),
    faces=np.array([(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]),
)
SHAPES = {"box": Box(size=(0.1, 0.2, 0.3)), "post": Cylinder(radius=0.1, length=0.5), "ball": Sphere(radius=0.1)}
SHAPES |= {"wall": Plane(), "wedge <1> & 2": WEDGE}
BAR = Solid(shape=Box(size=(0.03, 0.03, 0.1)), pose=Pose((0.0, 0.0, 0.05)))
CELL = Cell(
    model="xMatePro7",
    T_world_base=Pose((0.0, 0.0, 0.5)),
    tool=Tool(T_flange_tool=Pose((0.0, 0.0, 0.1)), payload=Payload(mass=0.5), solids=(BAR, Solid(shape=WEDGE))),
    parts=(Part(name="cube", solids=(BAR,), payload=Payload(mass=0.2)),),
    held="cube",
    obstacles=tuple(
        Obstacle(name=name, shape=shape, pose=Pose((2.0, float(number), 1.0)))
        for number, (name, shape) in enumerate(SHAPES.items())
    ),
)
MODEL = CELL.applied_to(rcilab.load_model("xMatePro7"))
RUN = build_run(some_cycles(), plan=PLAN, model=MODEL, setup=SETUP, cell=CELL)


def test_triangles_are_those_of_the_shapes() -> None:
    for shape, extent, volume in (
        (SHAPES["box"], (0.1, 0.2, 0.3), 6e-3),
        (SHAPES["post"], (0.2, 0.2, 0.5), np.pi * 5e-3),
        (SHAPES["ball"], (0.2, 0.2, 0.2), np.pi * 4e-3 / 3.0),
        (WEDGE, (0.1, 0.1, 0.1), 1e-3 / 6.0),
    ):
        mesh = shape_mesh(shape)
        corners = mesh.vertices[mesh.faces]
        assert np.ptp(mesh.vertices, axis=0) == pytest.approx(extent, rel=1e-6)
        # Of outward faces, to the coarseness of 32 sections.
        assert np.linalg.det(corners).sum() / 6.0 == pytest.approx(volume, rel=0.02)
    moved = solid_mesh(Solid(shape=Plane(), pose=Pose((1.0, 2.0, 3.0))))
    assert moved.vertices.mean(axis=0)[:2] == pytest.approx((1.0, 2.0))
    assert moved.vertices[:, 2].max() == pytest.approx(3.0)  # Free above it.


@pytest.mark.parametrize("is_written", [False, True], ids=["printed", "with meshes"])
def test_the_mjcf_has_the_solids_where_they_are(tmp_path: Path, capsys, is_written: bool) -> None:
    CELL.save(tmp_path / "cell.zip")
    argv = ["mjcf", "xMatePro7", "--cell", str(tmp_path / "cell.zip")]
    assert main([*argv, "--output", str(tmp_path)] if is_written else argv) == 0
    text = capsys.readouterr().out
    if is_written:
        spec = mujoco.MjModel.from_xml_path(str(tmp_path / "xMatePro7.xml"))
    else:
        spec = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(spec)
    data.qpos[:] = MODEL.home
    mujoco.mj_forward(spec, data)
    for number, name in enumerate(SHAPES, 1):
        geom = data.geom(f"obstacle {number}: {name}").id
        if name != next(reversed(SHAPES)):  # MuJoCo places a mesh by its centre of mass.
            assert data.geom_xpos[geom] == pytest.approx(CELL.solid(name).pose.position)
    assert data.geom("floor").xpos == pytest.approx((0.0, 0.0, -0.5))
    T_base_flange = MODEL.forward(MODEL.home) @ MODEL.T_flange_tool.inverse()
    assert data.geom("tool 1").xpos == pytest.approx((T_base_flange @ BAR.pose).position, abs=1e-9)
    assert data.geom("part 1").xpos == pytest.approx((MODEL.forward(MODEL.home) @ BAR.pose).position, abs=1e-9)
    assert data.site("tool").xpos == pytest.approx(MODEL.forward(MODEL.home).position, abs=1e-9)
    assert spec.body("load").mass[0] == pytest.approx(0.7)


def test_the_page_draws_obstacles_on_the_base_and_tool_and_part_on_the_last_link() -> None:
    page = export_run(RUN, ".html").decode()
    arm = json.loads(page.split('id="content">')[1].split("</script>")[0])["arm"]
    assert arm["floor"] == -0.5
    added = arm["meshes"][-8:]
    assert [mesh["link"] for mesh in added] == [0] * 5 + [7] * 3
    assert [mesh["casts"] for mesh in added] == [False] * 5 + [True] * 3
    assert "casts" not in arm["meshes"][-9]
    packed = gzip.decompress(base64.b64decode(page.split('id="arrays">')[1].split("<")[0]))
    box = added[0]["vertices"]
    corners = np.frombuffer(packed, box["kind"], box["count"], box["at"]).reshape(-1, 3)
    assert corners.mean(axis=0) == pytest.approx(CELL.solid("box").pose.position, abs=1e-6)
    assert np.ptp(corners, axis=0) == pytest.approx((0.1, 0.2, 0.3), abs=1e-6)


def test_an_mcap_has_the_cell_as_a_scene_and_the_flange_that_carries_its_tool() -> None:
    reader = pytest.importorskip("mcap.reader").make_reader(io.BytesIO(export_run(RUN, ".mcap")))
    found: dict[str, list] = {}
    for schema, channel, message in reader.iter_messages(topics=["/cell", "/flange", "/tool"]):
        content = json.loads(message.data)
        assert set(content) == set(json.loads(schema.data)["properties"])
        found.setdefault(channel.topic, []).append(content)
    (scene,) = found["/cell"]
    entities = {entity["id"]: entity for entity in scene["entities"]}
    assert list(entities) == [*(f"base/{name}" for name in SHAPES), "flange/tool", "flange/part"]
    assert entities["base/box"]["cubes"][0]["size"] == {"x": 0.1, "y": 0.2, "z": 0.3}
    assert len(entities["base/wedge <1> & 2"]["triangles"][0]["indices"]) == 12
    assert [len(entities["flange/tool"][kind]) for kind in ("cubes", "triangles")] == [1, 1]
    assert len(found["/flange"]) == len(found["/tool"]) == len(RUN.t)
    flange = MODEL.forward(RUN.q[-1]) @ MODEL.T_flange_tool.inverse()
    assert found["/flange"][-1]["translation"]["z"] == pytest.approx(flange.position[2])


def test_a_run_keeps_its_cell_and_its_check_has_it(tmp_path: Path) -> None:
    RUN.save(tmp_path / "a.rcirun")
    cell = load_run(tmp_path / "a.rcirun").cell
    assert cell is not None
    assert [obstacle.name for obstacle in cell.obstacles] == list(SHAPES)
    assert (cell.held, cell.floor_height) == ("cube", -0.5)
    assert "clearance.cell" in [row.id for row in load_run(tmp_path / "a.rcirun").report.rows]
    replace(RUN, cell=None).save(tmp_path / "b.rcirun")
    assert load_run(tmp_path / "b.rcirun").cell is None
