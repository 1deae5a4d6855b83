"""Every form in which a run is taken away holds the same numbers, with their units."""

from __future__ import annotations

import base64
import csv
import gzip
import io
import json
import math
import re
from dataclasses import replace

import numpy as np
import pytest

from rcilab.i18n.units import Units
from rcilab.model.robot_model import load_model
from rcilab.recording.columns import run_facts
from rcilab.recording.run import build_run
from tests.recording.runs import OFFSET, SETUP, export_run, some_cycles, some_ideal_run, some_run, some_stopped_run

RUN = some_run()


def test_tracking_knows_the_error_we_made():
    tracking = RUN.tracking
    assert RUN.delay == 1
    assert tracking.joint_max == pytest.approx([0.0, OFFSET, 0, 0, 0, 0, 0], abs=1e-12)
    assert tracking.joint_rms == pytest.approx([0.0, OFFSET, 0, 0, 0, 0, 0], abs=1e-12)
    assert tracking.rotation_max == pytest.approx(OFFSET, rel=1e-6)  # One joint turns the tool by its own error.
    q = np.array(RUN.planned[100])
    moved = RUN.model.forward(q + OFFSET * np.eye(7)[1]).position - RUN.model.forward(q).position
    assert tracking.position[100] == pytest.approx(np.linalg.norm(moved), rel=1e-9)


def test_a_csv_says_units_and_loses_no_digit():
    rows = list(csv.DictReader(io.StringIO(export_run(RUN, ".csv").decode())))
    assert len(rows) == len(RUN.t)
    assert [float(row["q[2] [rad]"]) for row in rows] == RUN.q[:, 1].tolist()
    assert [float(row["error[2] [rad]"]) for row in rows] == RUN.error[:, 1].tolist()
    assert [float(row["q_plan[1] [rad]"]) for row in rows] == RUN.planned[:, 0].tolist()
    without = {name for name in rows[0] if "[" not in name.replace("[", "", 1) and not name.endswith("]")}
    assert without == {
        "message_id", "success_rate", "faults", "lost", "braking", "robot_mode", "controller_mode",
        "motion_generator_mode",
    }  # fmt: skip
    assert {"command_pose[1,4] [m]", "command_pose[1,1]", "tool_error [m]", "t [s]", "tau[7] [N m]"} <= set(rows[0])


def test_a_data_frame_and_parquet_hold_the_same_columns():
    pandas, parquet = pytest.importorskip("pandas"), pytest.importorskip("pyarrow.parquet")
    frame = RUN.to_pandas()
    assert frame.index.name == "t"
    assert frame["q[2]"].tolist() == RUN.q[:, 1].tolist()
    assert frame.attrs["units"]["tool_error"] == "m"
    table = parquet.read_table(io.BytesIO(export_run(RUN, ".parquet")))
    assert set(table.column_names) == {"t", *frame.columns}
    assert table.schema.field("q[2]").metadata == {b"unit": b"rad"}
    assert json.loads(table.schema.metadata[b"rcilab"])["arm"] == "xMatePro7"
    assert isinstance(frame, pandas.DataFrame)


def test_an_mcap_opens_with_the_mcap_reader_and_fits_its_schemas():
    reader = pytest.importorskip("mcap.reader").make_reader(io.BytesIO(export_run(RUN, ".mcap")))
    summary = reader.get_summary()
    topics = {channel.topic for channel in summary.channels.values()}
    assert topics == {"/measured", "/commanded", "/plan", "/error", "/health", "/tool"}
    assert set(summary.statistics.channel_message_counts.values()) == {len(RUN.t)}
    first = {}
    for schema, channel, message in reader.iter_messages():
        assert (schema.encoding, channel.message_encoding) == ("jsonschema", "json")
        said = json.loads(message.data)
        assert set(said) == set(json.loads(schema.data)["properties"])
        first.setdefault(channel.topic, (message.log_time, said))
    assert first["/measured"][0] == SETUP.started_ns
    assert first["/measured"][1]["q"] == RUN.q[0].tolist()
    assert first["/error"][1]["joint"][1] == pytest.approx(OFFSET)
    assert first["/tool"][1]["pose"]["position"]["z"] == pytest.approx(RUN.model.forward(RUN.q[0]).position[2])
    (record,) = reader.iter_metadata()
    assert record.metadata["arm"] == "xMatePro7"


def test_nothing_an_export_says_is_no_number_in_json():
    facts = json.loads(json.dumps(run_facts(RUN), allow_nan=False))
    assert facts["conforms"] is True
    assert math.isclose(facts["tool_error_max_m"], RUN.tracking.position_max)


def test_the_facts_of_a_stopped_run_say_until_when_its_errors_count():
    facts = json.loads(json.dumps(run_facts(some_stopped_run()), allow_nan=False))
    assert facts["stop_time_s"] == pytest.approx(0.3)
    assert max(facts["error_max_rad"]) == pytest.approx(OFFSET)


def test_progress_ends_at_one_and_never_goes_back():
    for ending in (".csv", ".html", ".rcirun"):
        shares: list[float] = []
        export_run(RUN, ending, progress=shares.append)
        assert shares == sorted(shares)
        assert shares[-1] == 1.0


def content_of(page: bytes):
    return json.loads(page.decode().split('id="content">')[1].split("</script>")[0])


def test_the_page_is_drawn_in_the_units_of_the_workbench_and_never_finer_than_its_plots():
    si = content_of(export_run(some_ideal_run(), ".html", units=Units(angle="rad", length="m")))
    assert [chart["unit"] for chart in si["charts"]] == ["rad", "rad/s", "N·m", "mrad", "10⁻³ m"]
    assert si["facts"]["errors"][1] == ["J2", "0.000000 rad", "0.000000 rad"]
    assert si["run"]["limits"]["q"][1] == pytest.approx(RUN.model.limits.joint.upper)
    usual = content_of(export_run(some_ideal_run(), ".html"))
    assert [chart["unit"] for chart in usual["charts"]] == ["°", "°/s", "N·m", "°", "mm"]
    assert usual["charts"][3]["least"] == pytest.approx(0.02)
    assert usual["path"]["worst_text"] == "0.02 mm"  # Not 1.0e-9 mm.
    assert content_of(export_run(RUN, ".html"))["path"]["worst_text"] == "0.63 mm"


def test_the_page_of_an_arm_without_joint_torques_says_so_in_place_of_a_plot():
    cycles = some_cycles().copy()
    cycles["tau"] = np.nan
    run = build_run(cycles, plan=RUN.plan, model=RUN.model, setup=SETUP)
    for language, sentence in (("en", "This arm reports no joint torques."), ("zh", "该机械臂不上报关节力矩。")):
        content = content_of(export_run(run, ".html", language=language))
        assert [chart["name"] for chart in content["charts"]] == ["q", "dq", "error", "tool"]
        assert content["facts"]["notes"][-1] == sentence
        assert sentence not in content_of(export_run(RUN, ".html", language=language))["facts"]["notes"]


def test_the_page_of_an_arm_whose_velocity_bounds_depend_on_its_angles_has_them_as_curves():
    fr3 = load_model("FR3")
    page = export_run(build_run(some_cycles(), plan=None, model=fr3, setup=SETUP), ".html")
    arrays = content_of(page)["run"]["arrays"]
    packed = gzip.decompress(base64.b64decode(re.search(rb'id="arrays"[^>]*>([^<]+)<', page)[1]))
    lowest, highest = (
        np.frombuffer(packed, "<f4", arrays[name]["count"], arrays[name]["at"]).reshape(7, -1)
        for name in ("dq_lowest", "dq_highest")
    )
    at_angles = fr3.limits.joint.velocity_bounds(RUN.q_c)
    assert np.allclose(np.radians(lowest.T), at_angles[0], atol=1e-5)
    assert np.allclose(np.radians(highest.T), at_angles[1], atol=1e-5)
    assert np.ptp(highest[1]) > 10.0
    assert "dq_lowest" not in content_of(export_run(RUN, ".html"))["run"]["arrays"]


def test_the_page_asks_for_nothing_from_elsewhere_and_speaks_both_languages():
    for language, word in (("en", "Plan against actual"), ("zh", "规划与实际")):
        page = export_run(RUN, ".html", language=language).decode()
        assert "http" not in page.replace('http-equiv="Content-Security-Policy"', "")
        assert "default-src 'none'" in page
        assert word in page
        assert "@@" not in page


def test_the_page_of_a_callback_speaks_of_commands_and_of_no_plan(tmp_path):
    run = replace(some_run(), plan=None)
    for ending in (".html", ".csv", ".npz", ".rcirun"):
        run.save(tmp_path / f"a{ending}")
    page = (tmp_path / "a.html").read_text(encoding="utf-8")
    assert "measured minus commanded" in page
    assert "at its last command" in page
    assert "q_plan" not in (tmp_path / "a.csv").read_text().splitlines()[0]


def test_parquet_and_mcap_of_a_callback_have_no_plan_and_compare_with_its_commands():
    run = replace(some_run(), plan=None)
    parquet, mcap = pytest.importorskip("pyarrow.parquet"), pytest.importorskip("mcap.reader")
    table = parquet.read_table(io.BytesIO(export_run(run, ".parquet")))
    assert not [name for name in table.column_names if "plan" in name]
    assert table["error[2]"].to_pylist()[5] == pytest.approx(OFFSET)
    reader = mcap.make_reader(io.BytesIO(export_run(run, ".mcap")))
    topics = {channel.topic: channel.schema_id for channel in reader.get_summary().channels.values()}
    assert "/plan" not in topics
    schema = json.loads(reader.get_summary().schemas[topics["/error"]].data)
    told = " ".join(entry["description"] for entry in schema["properties"].values())
    assert "measured minus commanded" in told
    assert "plan" not in told


def test_a_name_that_reverses_the_writing_direction_leaves_the_rest_of_a_page_readable():
    run = replace(some_run(stopped="\u202eno"), setup=replace(SETUP, target="rci://\u202e\x1b[2J"))
    for page in (export_run(run, ".html").decode(), run._repr_html_()):
        assert "\u202e" not in page
        assert "\\u202eno" in page.replace("\\\\", "\\")
