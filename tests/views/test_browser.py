"""What a browser makes of the scene: a person's view of the arm, measured in the page itself."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from rcilab.model.robot_model import load_model
from rcilab.views.arm_view import ArmView
from rcilab.views.viser_scene import ViserScene
from rcilab.views.viser_stage import add_environment

pytestmark = pytest.mark.browser

FLAGS = [
    "--no-sandbox",
    "--no-first-run",
    "--use-gl=angle",
    "--use-angle=swiftshader",
    "--enable-unsafe-swiftshader",
    "--disable-gpu-rasterization",  # Debian's launcher switches it on, which the processor then has to imitate.
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-renderer-backgrounding",
    "--disable-background-timer-throttling",
    "--force-color-profile=srgb",
]
WORLD_POSE = """name => { const node = __viserMutable.nodeRefFromName[name], root = __viserMutable.nodeRefFromName[''];
    node.updateWorldMatrix(true, false);
    const T = node.matrixWorld.clone();
    return T.premultiply(root.matrixWorld.clone().invert()).elements; }"""


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    path = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    if path is None:
        if os.environ.get("CI") == "true":
            pytest.fail("CI=true but no Chromium was found")
        pytest.skip("no Chromium on this machine")
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright:
        running = playwright.chromium.launch(executable_path=path, args=FLAGS)
        yield running
        running.close()


def test_the_page_shows_the_arm_where_our_kinematics_put_it(browser: Any) -> None:
    import viser

    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    try:
        add_environment(server, full=False)
        model = load_model("xMatePro7")
        arm = ArmView(ViserScene(server, shadows=False), "live", model)
        arm.show(model.home)
        page = browser.new_page(viewport={"width": 480, "height": 360})
        page.goto(f"http://127.0.0.1:{server.get_port()}/?fixedDpr=0.5")
        page.wait_for_function(
            "name => window.__viserMutable && __viserMutable.nodeRefFromName[name]"
            " && __viserTestpoints.rendererInfo.render.frame > 3",
            arg=arm.tool_node,
            timeout=120_000,
        )
        for q in (model.home, np.linspace(-1.0, 1.2, 7)):
            arm.show(q)
            expected = model.forward(q).matrix
            page.wait_for_function(
                f"([name, z]) => Math.abs(({WORLD_POSE})(name)[14] - z) < 1e-5",
                arg=[arm.tool_node, float(expected[2, 3])],
                timeout=60_000,
            )
            shown = np.array(page.evaluate(WORLD_POSE, arm.tool_node)).reshape(4, 4).T
            assert np.abs(shown - expected).max() < 1e-5
        page.close()
    finally:
        server.stop()
