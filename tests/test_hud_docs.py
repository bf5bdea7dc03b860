"""The condition in docs/hud.md is complete: its very text runs."""

import dataclasses
import math
import re
import sys
from collections.abc import Iterator
from pathlib import Path

import hud_sample as sample
import pytest

from hud.conditions import Condition, condition, condition_names
from hud.options import option_names

DOCUMENT = Path(__file__).parents[1] / "docs" / "hud.md"


@pytest.fixture
def arrow(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Condition]:
    text = DOCUMENT.read_text(encoding="utf-8")
    (code,) = [c for c in re.findall(r"```python\n(.*?)```", text, re.DOTALL) if "def hud_state" in c]
    (tmp_path / "arrow_of_the_docs.py").write_text(code, encoding="utf-8")
    monkeypatch.syspath_prepend(str(tmp_path))
    yield condition("arrow_of_the_docs:hud_state")
    sys.modules.pop("arrow_of_the_docs", None)


@pytest.mark.parametrize("yaw", [0.0, 1.5, 3.1, -1.5])
def test_the_arrow_of_the_docs_points_to_the_next_object_only(arrow: Condition, yaw: float) -> None:
    view = dataclasses.replace(sample.task(6), camera=sample.camera(640, 480, yaw=yaw))
    state = arrow(view)
    plain = condition("none")(view)
    assert dataclasses.replace(state, pointer=None) == plain and state.markers == ()
    assert view.goal is not None and view.camera is not None
    right, up, forward = (float(v) for v in view.camera.to_eye(view.goal))
    half = math.tan(view.camera.fovy / 2)
    inside = forward > 0 and abs(up) < half * forward and abs(right) < half * 640 / 480 * forward
    assert (state.pointer is None) is inside
    if state.pointer is not None:
        assert math.cos(state.pointer.angle) * right > 0


def test_the_arrow_of_the_docs_says_nothing_of_bins(arrow: Condition) -> None:
    view = dataclasses.replace(sample.task(6, steps=2), camera=sample.camera(640, 480, yaw=3.0))
    assert view.plan[0].kind == "place" and condition("guided")(view).pointer is not None
    assert arrow(view).pointer is None


def test_the_docs_name_every_condition_and_option() -> None:
    text = DOCUMENT.read_text(encoding="utf-8")
    assert all(f"`{name}`" in text for name in (*condition_names(), *option_names()))
