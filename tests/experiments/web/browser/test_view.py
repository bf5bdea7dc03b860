"""The page of `mjsim view` in Chromium, as a file without a server."""

import pytest

from experiments.trials.trial import run_trial
from experiments.trials.trial_config import TrialConfig
from experiments.web.client_files import STATIC
from experiments.web.viewing.page import view_page

pytestmark = [pytest.mark.slow, pytest.mark.xdist_group("view")]

HARMLESS = ("KHR_parallel_shader_compile", "GL Driver Message")  # said where there is no graphics card
LOADED = "document.getElementById('debug').textContent === ''"
# How much of the picture differs from its commonest colour.
VARIED = """() => {
    const canvas = document.getElementById("screen"), small = document.createElement("canvas");
    [small.width, small.height] = [32, 24];
    return new Promise((resolve) => requestAnimationFrame(() => {
        const to = small.getContext("2d");
        to.drawImage(canvas, 0, 0, 32, 24);
        const pixels = to.getImageData(0, 0, 32, 24).data, colours = new Map();
        for (let i = 0; i < pixels.length; i += 4) {
            const key = [0, 1, 2].map((k) => pixels[i + k] >> 4).join();
            colours.set(key, (colours.get(key) ?? 0) + 1);
        }
        resolve(1 - Math.max(...colours.values()) / (32 * 24));
    }));
}"""


EMULATOR = STATIC.parent / "node_modules/iwer/build/iwer.min.js"
WORN = """
const device = new IWER.XRDevice(IWER.metaQuest3);
device.installRuntime({ forceInstall: true });
device.stereoEnabled = true;
"""


@pytest.fixture(scope="module")
def address(tmp_path_factory):
    folder = tmp_path_factory.mktemp("view")
    config = TrialConfig(objects=1, assistance="guided", seed=2, fidelity="event")
    run_trial(config, folder / "run", topdown=False)
    (folder / "run.html").write_text(view_page(folder / "run"), "utf-8")
    return (folder / "run.html").as_uri()


@pytest.fixture
def page(chromium, address):
    faults = []
    page = chromium.new_page(viewport={"width": 960, "height": 540})
    page.on("console", lambda line: faults.append(line.text) if line.type in ("error", "warning") else None)
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.on("request", lambda request: faults.append(request.url) if request.url.startswith("http") else None)
    page.goto(address)
    page.wait_for_function(LOADED)
    yield page
    assert [fault for fault in faults if not any(words in fault for words in HARMLESS)] == []


def test_a_run_can_be_played_and_searched(page):
    assert page.locator("#list li").count() == 2  # a pick and a place
    assert page.locator("#progress").inner_text() == "0 / 1 put away"
    page.get_by_role("button", name="in its bin").click()
    page.locator("#list .done").nth(1).wait_for()
    assert page.locator("#progress").inner_text() == "1 / 1 put away"
    page.locator("#screen").focus()
    for _ in range(4):
        page.keyboard.press("ArrowLeft")  # a second
    page.locator("#list li:nth-child(2)[aria-current]").wait_for()
    page.get_by_label("Speed").select_option("8")
    page.keyboard.press("Space")
    page.get_by_role("button", name="Pause").wait_for()
    page.get_by_role("button", name="Play", exact=True).wait_for()  # at the end it stops
    first, last = page.locator("#seconds").inner_text().removesuffix(" s").split(" / ")
    assert first == last


@pytest.mark.parametrize("camera", ["Person", "Above", "Free"])
def test_every_camera_shows_the_house(page, camera):
    page.get_by_role("button", name=camera).click()
    page.wait_for_function(f"({VARIED})().then((share) => share > 0.3)")


def test_a_headset_shows_the_run_from_the_persons_eyes(chromium, address):
    if not EMULATOR.is_file():
        pytest.skip("the client's packages are not installed: npm ci")
    page = chromium.new_page(viewport={"width": 800, "height": 400})
    page.set_default_timeout(60_000.0)
    page.add_init_script(EMULATOR.read_text(encoding="utf-8") + WORN)
    page.goto(address)
    page.wait_for_function(LOADED)
    page.get_by_role("button", name="Above").click()
    page.get_by_role("button", name="Play", exact=True).click()
    page.get_by_role("button", name="Headset").click()
    at = "Number(document.getElementById('time').value)"
    begin = page.evaluate(at)
    page.wait_for_function(f"{at} > {begin} + 0.5")  # pictures come from the headset now
    page.wait_for_function(f"({VARIED})().then((share) => share > 0.3)")
    page.close()
