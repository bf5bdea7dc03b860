"""Whole visits from a platform and back to it, by keys and clicks; then the platform pays.

Where the machine has NGINX, visits go through it, with TLS.
"""

import os
import sqlite3
import subprocess
import sys
import time
from contextlib import nullcontext

import pytest
from nginx_site import NGINX, make_certificate, nginx_before

from benchmarks.support.play_server import PATIENCE
from benchmarks.support.ports import free_ports, listens
from tests.experiments.study.platforms.emulator import SECRET
from tests.experiments.study.platforms.external_question import ExternalQuestion
from tests.experiments.study.platforms.prolific import STUDY as PROLIFIC_STUDY
from tests.experiments.study.platforms.prolific import Prolific
from tests.experiments.web.browser.key_presser import WATCH
from tests.experiments.web.browser.pages import FIREFOX, XVFB, Chromium, firefox, virtual_screen
from tests.experiments.web.browser.study_visit import STUDY, StudyVisit

pytestmark = [pytest.mark.slow, pytest.mark.long]

RECRUITMENT = """
[study.recruitment]
platform = "{name}"
completed = "C0MPLETE"
screened_out = "SCREEN0UT"
no_consent = "N0C0NSENT"
study_id = "{study_id}"
sites = ["{url}"]
api_url = "{url}"
"""
FEW = [("chromium", "external-question")]
MANY = [(b, p) for b in ("chromium", "firefox") for p in ("prolific", "external-question")]
CASES = MANY if "MJSIM_ALL_CONDITIONS" in os.environ else FEW
TITLE = "document.querySelector('h1')?.textContent"


@pytest.fixture
def secure_page(request, tmp_path, browser):
    """A page that takes a certificate that nobody has signed."""
    if browser == "chromium":
        chromium = request.getfixturevalue("chromium")
        page = chromium.new_context(ignore_https_errors=True).new_page()
        yield Chromium(page)
    elif FIREFOX is None or XVFB is None:
        pytest.skip("no Firefox here, or no Xvfb, without which it has no WebGL")
    else:
        with virtual_screen() as screen, firefox(tmp_path / "profile", screen) as page:
            yield page


@pytest.fixture
def served(tmp_path, platform):
    """URL of a study, and its folder."""
    front, behind = free_ports(2)
    study_id = PROLIFIC_STUDY if platform.name == "prolific" else ""
    recruitment = RECRUITMENT.format(name=platform.name, url=platform.url, study_id=study_id)
    (tmp_path / "study.toml").write_text(STUDY + recruitment)
    url = f"https://localhost:{front}" if NGINX else f"http://localhost:{behind}"
    words = ["--out", "out", "--port", str(behind), "--public-url", url, "--trusted-proxy", "127.0.0.1"]
    with (tmp_path / "log.txt").open("w") as log:
        command = [sys.executable, "-m", "mjsim", "study", "serve", "study.toml", "--no-open", *words]
        server = subprocess.Popen(command, cwd=tmp_path, stdout=log, stderr=log)
    until = time.monotonic() + PATIENCE
    while not listens(behind) and time.monotonic() < until:
        time.sleep(0.05)
    with nginx_before(tmp_path, [behind], front, make_certificate(tmp_path)) if NGINX else nullcontext():
        yield url, tmp_path
    server.terminate()
    server.wait()


@pytest.fixture
def platform(name, monkeypatch):
    running = {"prolific": Prolific, "external-question": ExternalQuestion}[name]()
    running.name = name
    monkeypatch.setenv(running.variable, SECRET)
    with running.running():
        yield running


@pytest.mark.parametrize(("browser", "name"), CASES)
def test_a_whole_visit_from_the_platform_and_back(served, platform, secure_page):
    (url, folder), page = served, secure_page
    platform.study_url = f"{url}/"
    page.prepare(WATCH)
    page.resize(900, 760)
    if platform.name == "prolific":
        page.goto(f"{platform.url}/studies/1")
        page.click("a")
    else:
        page.goto(f"{platform.url}/preview/1")
        page.enter_frame()
        page.wait_for("document.body?.textContent.includes('This is a preview')")
        assert page.evaluate("document.querySelector('form') === null")
        page.enter_frame(False)
        page.click("button")
        page.wait_for(f"{TITLE} === 'A task'")
        page.enter_frame()
    visit = StudyVisit(page, folder / "out")
    visit.go_to_the_end()
    page.click("a.button, form .button")
    last = "Submission received" if platform.name == "prolific" else "The task has been submitted"
    page.wait_for(f"{TITLE} === '{last}'")
    visit.check_record()
    pay = [
        sys.executable,
        "-m",
        "mjsim",
        "study",
        "pay",
        "study.toml",
        "out",
        "--send",
        "--without-rehearsal",
    ]
    subprocess.run(pay, cwd=folder, check=True)
    assert sorted(str(what) for _, what in platform.paid()) == ["100", "approved"]
    with sqlite3.connect(folder / "out" / "study.db") as database:
        assert database.execute("SELECT status, phase FROM person").fetchall() == [("finished", "completion")]
    database.close()
