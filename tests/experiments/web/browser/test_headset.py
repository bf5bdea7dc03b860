"""The house in an emulated headset (experimental): two pictures, the head looks, controllers walk and press."""

import base64
import json
import math
import tomllib
from pathlib import Path

import numpy as np
import pytest

import experiments
from mjsim.formats.gltf.export import export_scene
from tools.drawn_pairs import decoded, sampled_scene, served

pytestmark = pytest.mark.slow

EMULATOR = Path(__file__).parents[4] / "experiments/web/client/node_modules/iwer/build/iwer.min.js"
START = """async ([position, heading]) => {
  const device = new IWER.XRDevice(IWER.metaQuest3);
  device.installRuntime({ forceInstall: true });
  device.stereoEnabled = true;
  const { HeadsetPage } = await import("/static/headset.js");
  const plain = { detail: "Kitchen\\n-> Dish bin", number: null, done: false, carried: false };
  const row = (text, more) => ({ text, ...plain, ...more });
  const hud = {
    checklist_title: "Your plan", checklist: [row("Mug", { done: true }), row("Pan", { current: true }), row("Book")],
    bins: [{ label: "Dish bin", place: "Kitchen" }], inventory: [{ label: null }, { label: "Pan" }],
    message: null, delivered: 1, total: 3, scroll: 0,
  };
  const seen = { heading, pitch: 0, held: null, pressed: [] };
  const headset = new HeadsetPage(world, {
    look: (turn, pitch) => { seen.heading += turn; seen.pitch += pitch; },
    hold: (_, held) => { seen.held = held; },
    press: (name) => seen.pressed.push(name),
  });
  const button = document.createElement("button");
  await headset.offer(button, () => heading);
  Object.assign(window, { device, seen, world, frames: 0 });
  world.onFrame(() => { headset.place(position); headset.show(hud, 67); world.draw(); frames++; });
  button.click();
  return !button.hidden;
}"""
PATIENCE = 60_000  # ms
AFTER = """async () => {
  const at = frames;
  while (frames < at + 3) await new Promise((resolve) => setTimeout(resolve, 20));
  return [seen.held, seen.pressed.splice(0)];
}"""
PICTURE = """() => new Promise((resolve) => {
  const at = frames;
  const look = () => {
    if (frames < at + 3) return void setTimeout(look, 20);
    requestAnimationFrame(() => { world.draw(); resolve(document.querySelector("canvas").toDataURL()); });
  };
  look();
})"""

GIVE_TEXTS = """(texts) => {
  const element = document.createElement("script");
  document.body.append(Object.assign(element, { id: "texts", type: "application/json", textContent: texts }));
}"""


def texts():
    """All English texts of pages."""
    tables = tomllib.loads((Path(experiments.__file__).parent / "texts" / "en.toml").read_text("utf-8"))
    return {name: text for table in tables.values() for name, text in table.items() if isinstance(text, str)}


@pytest.fixture
def page(chromium):
    if not EMULATOR.is_file():
        pytest.skip("the client's packages are not installed: npm ci")
    files = export_scene(sampled_scene().catalogue)
    with served({f"/scene/{name}": data for name, data in files.items()}) as address:
        page = chromium.new_page(viewport={"width": 800, "height": 400})
        page.goto(address)
        page.wait_for_function("window.ready")
        page.evaluate(GIVE_TEXTS, json.dumps(texts()))
        page.add_script_tag(content=EMULATOR.read_text(encoding="utf-8"))
        yield page
        page.close()


def test_a_headset_shows_the_house_and_the_hud_to_both_eyes(page):
    assert page.evaluate(START, [[6.4, 5.2, 1.6], 0.5])
    page.wait_for_function("seen.held && frames > 3", timeout=PATIENCE)
    picture = decoded(base64.b64decode(page.evaluate(PICTURE).partition(",")[2]))
    left, right = np.array_split(picture, 2, axis=1)
    assert min(left.std(), right.std()) > 10
    assert np.abs(left.astype(int) - right).mean() > 1
    assert page.evaluate("[seen.heading, seen.pitch]") == pytest.approx([0.5, 0.0], abs=1e-6)

    turned = [math.cos(0.2), 0.0, math.sin(0.2), 0.0]  # 0.4 rad to the left about the vertical
    page.evaluate("([w, x, y, z]) => device.quaternion.set(x, y, z, w)", turned)
    page.wait_for_function("seen.heading > 0.89", timeout=PATIENCE)
    page.evaluate(
        """() => {
          device.controllers.left.updateAxes("thumbstick", 0, -1);
          device.controllers.right.updateAxes("thumbstick", 1, 0);
          device.controllers.right.updateButtonValue("trigger", 1);
        }"""
    )
    assert page.evaluate(AFTER) == [{"forward": 1, "left": 0}, ["right hand"]]
    assert page.evaluate(AFTER) == [{"forward": 1, "left": 0}, []]
    page.wait_for_function(f"seen.heading < {0.9 - math.pi / 6 + 0.01}", timeout=PATIENCE)
    page.evaluate("world.stage.renderer.xr.getSession().end()")
    page.wait_for_function("Object.keys(seen.held).length === 0", timeout=PATIENCE)
