"""After a run: its error in the panel, its file in the downloads, and that file alive with the network cut off."""

from __future__ import annotations

import csv
import itertools
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rcilab.app.learn.learn_state import displayed_state
from rcilab.app.run.replay import replayed_pose
from rcilab.app.run.run_recorder import whole_recording
from rcilab.app.store import RunsFolder
from rcilab.app.view_actions import SetView
from rcilab.makers.rokae.faults import Fault
from rcilab.model.robot_model import RobotModel
from rcilab.recording.run import build_run
from rcilab.recording.run_setup import Setup
from tests.recording.runs import MODEL, PLAN, export_run, some_cycles, some_ideal_run, some_long_run, some_run


def plot_numbers(page) -> list[list[str]]:
    """The numbers beside every plot that is shown, upwards."""
    return page.tab.evaluate(
        "() => Object.values(__viserTestpoints.uplots).filter(({ chart }) => chart.root.offsetParent !== null)"
        ".sort((a, b) => a.chart.root.getBoundingClientRect().top - b.chart.root.getBoundingClientRect().top)"
        ".map(({ chart }) => (chart.axes[1]._values || []).map(String))"
    )


def test_a_run_is_shown_against_its_plan_and_downloaded(page, tmp_path):
    page.bench.dispatcher.ask(SetView(name="plot_joint", value=0))
    page.plan_to(1, 12.0 if page.status.q_c[0] <= 0 else -12.0)
    page.open_tab("Run")
    page.wait(lambda: page.button("Execute").is_enabled(), "Execute to be pressable")
    page.button("Execute").click()
    page.wait(lambda: page.state.recording is not None and page.state.recording.run is not None, "a finished run", 30)
    page.wait(
        lambda: "Ran to its end" in page.tab.locator(".rl-verdict:visible").all_inner_texts().__str__(), "its end"
    )
    page.wait(lambda: page.tab.locator(".rl-plot-title", has_text="Tool error").count() == 1, "a plot of errors")
    page.wait(lambda: len(plot_numbers(page)) == len(page.state.plots), "all plots that are chosen")
    assert all(len(numbers) >= 2 for numbers in plot_numbers(page)), plot_numbers(page)
    assert plot_numbers(page)[:4] == [["-100", "0", "100"]] * 4  # As low as they are on a small page.
    page.unfold("Recording")
    page.wait(lambda: page.button("CSV").is_enabled(), "exports to be pressable")
    with page.tab.expect_download(timeout=20_000) as coming:
        page.button("CSV").click()
    coming.value.save_as(tmp_path / "run.csv")
    with open(tmp_path / "run.csv", newline="") as stream:
        rows = list(csv.DictReader(stream))
    run = page.state.recording.run
    assert [float(row["q[1] [rad]"]) for row in rows] == run.q[:, 0].tolist()
    assert "q_plan[1] [rad]" in rows[0]


def test_a_fault_has_a_flag_with_its_name_in_the_plots(page):
    run = some_run()
    cycles = run.cycles.copy()
    cycles["faults"][len(cycles) // 2 :] = 1 << Fault.COLLISION
    page.bench.store.update(recording=whole_recording(replace(run, cycles=cycles)))
    flags = page.tab.locator(".rl-fault:visible")
    page.wait(lambda: flags.count() == len(page.state.plots), "a line in every plot")
    assert page.tab.locator(".rl-fault span:visible").all_inner_texts() == [Fault.COLLISION.manual_name]
    page.bench.store.update(recording=None)
    page.wait(lambda: flags.count() == 0, "none without the run")


def test_a_recorded_run_is_opened_from_the_list_and_left_again(page, tmp_path):
    run = some_run()
    cycles = run.cycles.copy()
    cycles["faults"][len(cycles) // 2 :] = 1 << Fault.COLLISION
    replace(run, cycles=cycles).save(tmp_path / "a.rcirun")
    page.bench.store.update(runs=tmp_path, record=False)
    page.open_tab("Run")
    page.unfold("Recording")
    row = page.tab.locator('[data-run="a.rcirun"]')
    page.wait(lambda: row.count() == 1 and Fault.COLLISION.manual_name in row.inner_text(), "the run in the list")
    row.click()
    page.wait(lambda: page.state.replay is not None, "the run", 30)
    opened = displayed_state(page.state)
    there = opened.model.forward(replayed_pose(opened)).matrix  # With the tool of the run.
    page.wait(lambda: np.allclose(page.tool_pose("live"), there, atol=1e-4), "the recorded arm at its fault")
    page.wait(lambda: page.tab.locator(".rl-fault span:visible").count() == 1, "the flag")
    assert page.tab.get_by_text("Recorded run:").is_visible()
    assert page.button("Execute").is_disabled()
    page.button("Back to the robot").first.click()
    page.wait(lambda: page.state.replay is None, "the robot")
    page.wait(lambda: page.shows("live", page.status.q), "the robot in the scene")
    page.bench.store.update(runs=None, record=True, folder=RunsFolder())


def test_a_long_export_is_cancelled_and_the_next_one_comes(page, tmp_path):
    page.bench.store.update(last_run=whole_recording(some_long_run()))
    downloads: list[object] = []

    def note(download) -> None:
        downloads.append(download)

    page.tab.on("download", note)
    page.open_tab("Run")
    page.unfold("Recording")
    page.wait(lambda: page.button("CSV").is_enabled(), "exports to be pressable")
    page.button("CSV").click()
    page.wait(lambda: page.tab.get_by_text("Writing CSV").is_visible(), "the progress")
    page.button("Cancel the export").click()
    page.wait(lambda: "was cancelled" in page.toast(), "that it was cancelled")
    page.wait(lambda: page.state.export is None and page.button("CSV").is_enabled(), "the end of the export")
    assert page.button("Cancel the export").count() == 0
    assert downloads == []
    page.bench.store.update(last_run=whole_recording(some_run()))
    with page.tab.expect_download(timeout=20_000) as coming:
        page.button("CSV").click()
    coming.value.save_as(tmp_path / "run.csv")
    assert len((tmp_path / "run.csv").read_text().splitlines()) == 1 + len(some_run().t)
    page.tab.remove_listener("download", note)
    page.bench.store.update(last_run=None)


_NOTE_NUMBERS = """() => {
  window.numbers = [];
  const write = CanvasRenderingContext2D.prototype.fillText;
  CanvasRenderingContext2D.prototype.fillText = function (said, x, y) {
    const isNumber = this.textAlign === "right" && !this.font.includes("600");
    if (isNumber) window.numbers.push({ said, left: x - this.measureText(said).width, y });
    write.call(this, said, x, y);
  };
}"""
"""Notes the numbers beside the axes of an exported page as they are written."""


@pytest.mark.parametrize("size", [(1280, 800), (960, 420)])
@pytest.mark.parametrize("run", [some_ideal_run(), some_run()], ids=["ideal", "lagging"])
def test_every_axis_of_the_exported_page_says_numbers_that_differ_and_are_seen_whole(chromium, tmp_path, run, size):
    file = Path(tmp_path / "run.html")
    file.write_bytes(export_run(run, ".html"))
    tab = chromium.new_page(viewport={"width": size[0], "height": size[1]})
    tab.add_init_script(f"({_NOTE_NUMBERS})()")
    tab.goto(file.as_uri())
    tab.wait_for_selector("body[data-ready=yes]", state="attached", timeout=60_000)
    tab.evaluate("window.numbers = []; document.getElementById('joint').dispatchEvent(new Event('change'))")
    numbers = tab.evaluate("window.numbers")
    tab.close()
    plots: list[list[dict]] = []
    for number in numbers:  # A plot says its numbers upwards; the next one begins further below.
        if not plots or number["y"] > plots[-1][-1]["y"]:
            plots.append([])
        plots[-1].append(number)
    assert len(plots) == 5
    for plot in plots:
        values = [float(number["said"]) for number in plot]
        assert len(values) >= 2, values
        assert values == sorted(set(values)), values
        assert min(number["left"] for number in plot) >= 0.0
        assert min(below["y"] - above["y"] for below, above in itertools.pairwise(plot)) >= 11.0  # [px] Of the font.
        assert max(len(number["said"]) for number in plot) <= 6, values


def test_the_exported_page_lives_without_a_network(chromium, tmp_path):
    run = some_run()
    file = Path(tmp_path / "run.html")
    file.write_bytes(export_run(run, ".html"))
    context = chromium.new_context(viewport={"width": 640, "height": 420}, offline=True)
    context.set_default_timeout(60_000)  # Another page draws beside it, in software.
    tab = context.new_page()
    problems: list[str] = []
    asked: list[str] = []
    tab.on("pageerror", lambda error: problems.append(str(error)))
    tab.on("console", lambda said: problems.append(said.text) if said.type == "error" else None)
    tab.on("request", lambda request: asked.append(request.url))
    tab.goto(file.as_uri())
    tab.wait_for_selector("body[data-ready=yes]", state="attached", timeout=60_000)
    assert tab.locator("#missing").is_hidden()
    pictures = [tab.locator("#scene").screenshot()]
    tab.get_by_role("slider").focus()
    tab.keyboard.press("End")
    assert tab.locator("#clock b").inner_text() == f"{run.t[-1]:.3f}"
    pictures.append(tab.locator("#scene").screenshot())
    assert pictures[0] != pictures[1], "the arm stands elsewhere at the end"
    tab.get_by_label("Joint").select_option("2")
    largest = np.degrees(run.tracking.joint_max[1])
    assert f"{largest:.4f}°" in tab.locator("table.numbers").inner_text()
    said = tab.evaluate("() => { const b = document.getElementById('play'); b.click(); return b.textContent; }")
    assert said == "Pause"
    assert problems == []
    assert asked == [file.as_uri()]
    context.close()


_HOSTILE = (
    "@@PAGE@@ @@TITLE@@ </script><script>window.hurt = 1</script> "
    "<!--<script <img src=x onerror='window.hurt = 2'> \\u003c"
)


def test_words_of_a_run_are_words_on_the_exported_page_whatever_they_are(chromium, tmp_path):
    setup = Setup(target=f"{_HOSTILE} 1", plant=f"{_HOSTILE} 2", mode=f"{_HOSTILE} 3", started_ns=1)
    arm = RobotModel(replace(MODEL.description, name=f"{_HOSTILE} 5"), MODEL.T_flange_tool, MODEL.load)
    plan = replace(PLAN, notes=(f"{_HOSTILE} 6",))
    run = build_run(some_cycles(), plan=plan, model=arm, setup=setup, stopped=f"{_HOSTILE} 4")
    file = Path(tmp_path / f"{_HOSTILE.replace('/', '')}.html")
    file.write_bytes(export_run(run, ".html"))
    tab = chromium.new_page()
    problems: list[str] = []
    tab.on("pageerror", lambda error: problems.append(str(error)))
    tab.on("console", lambda said: problems.append(said.text) if said.type == "error" else None)
    tab.goto(file.as_uri())
    tab.wait_for_selector("body[data-ready=yes]", state="attached", timeout=60_000)
    shown = tab.locator("#tables").inner_text()
    assert [f"{_HOSTILE} {number}" in shown for number in (1, 2, 3, 4)] == [True] * 4
    assert f"{_HOSTILE} 5" in tab.title()
    assert tab.evaluate("window.hurt") is None
    tab.evaluate("document.body.insertAdjacentHTML('beforeend', '<img src=x onerror=\"window.hurt = 3\">')")
    tab.evaluate("document.body.append(Object.assign(document.createElement('script'), {text: 'window.hurt = 4'}))")
    assert tab.evaluate("window.hurt") is None, "the policy of the page lets no other script run"
    tab.close()
    assert [problem for problem in problems if "Content Security Policy" not in problem] == []
