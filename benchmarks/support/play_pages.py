"""`mjsim play` in a real browser: tasks done by key events alone, and how soon one sees something on a slow link."""

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import msgspec

from benchmarks.support.play_keys import CHROMIUM, play_by_keys
from benchmarks.support.play_link import SlowLink
from benchmarks.support.play_server import PATIENCE, PlayProcess, Say
from experiments.errors import ExperimentError
from experiments.house import House
from experiments.replaying.replay import replay
from experiments.runs import records

BITS, DELAY = 10e6, 0.08  # of the slow link: bits a second; s each way
TASK_LIMIT = 1800.0  # s of wall time
DRAWN = "() => { const c = document.getElementById('screen'); return c && %s; }"
NOT_EMPTY = (
    "c.getContext('2d').getImageData(0, 0, c.width, c.height).data.some((value, i) => i % 4 < 3 && value > 0)"
)


def measure_pages(
    folder: Path, objects: int, conditions: Sequence[str], say: Say, *words: str
) -> dict[str, Any]:
    """Do a task in each condition by key events, and load the first frame over a slow link.

    Args:
        folder: Gets a folder of visits for each server.
        objects: Of a task.
        conditions: Of assistance.
        say: Takes a line about what is under way.
        words: Further words of the server's command line.
    """
    with _chromium() as browser:
        tasks = {}
        for name in conditions:
            say(f"{objects} objects under {name}")
            tasks[name] = _task(browser, folder / name, objects, name, *words)
        say("a slow link")
        seconds, megabytes = _first_frame(browser, folder / "link", *words)
    return {
        "tasks": tasks,
        "undone": sum(task["delivered"] < objects for task in tasks.values()),
        "unlike_replay": sum(not task["replayed"] for task in tasks.values()),
        "first_frame_s": seconds,
        "first_frame_mb": megabytes,
    }


def _task(browser: Any, folder: Path, objects: int, assistance: str, *words: str) -> dict[str, Any]:
    """What became of a task, and whether its replay has the same metrics."""
    folder.mkdir()
    options = ("--objects", str(objects), "--assistance", assistance, *words)
    page = browser.new_page(viewport={"width": 640, "height": 480})
    with PlayProcess(folder / "visits", *options) as server:
        run = play_by_keys(page, server, House.load(), TASK_LIMIT)
        page.close()
    metrics = msgspec.json.decode((run / records.METRICS).read_bytes())
    try:
        replayed = all(verdict.verified for verdict in replay(run).verdicts)
    except ExperimentError:
        replayed = False
    kept = ("ended", "delivered", "completion_time_s", "task_distance_m", "refusals")
    return {**{name: metrics[name] for name in kept}, "replayed": replayed}


def _first_frame(browser: Any, folder: Path, *words: str) -> tuple[float, float]:
    """Time from the click that begins a visit to its first frame, s, and what was transferred until then, MB."""
    folder.mkdir()
    with SlowLink(BITS, DELAY) as link:
        url = f"http://127.0.0.1:{link.port}"
        server = PlayProcess(folder / "visits", "--public-url", url, *words)
        server.url = f"http://127.0.0.1:{link.target}/"  # where it listens
        with server:
            server.wait_until_warm()
            page = browser.new_page(viewport={"width": 1280, "height": 720})
            page.set_default_timeout(1000.0 * PATIENCE)
            page.goto(url)
            began = time.perf_counter()
            page.get_by_role("button", name="Begin").click()
            page.wait_for_url("**/play/*")
            page.wait_for_function(DRAWN % NOT_EMPTY, polling=50)
            took = time.perf_counter() - began
            page.close()
    return took, link.bytes / 1e6


@contextmanager
def _chromium() -> Iterator[Any]:
    from playwright.sync_api import sync_playwright

    with sync_playwright() as driver:
        browser = driver.chromium.launch(executable_path=str(CHROMIUM), args=["--no-sandbox"])
        yield browser
        browser.close()
