"""What `deploy/` holds works with the programs that it is for, where this machine has them."""

import json
import re
import shlex
import shutil
import ssl
import subprocess
import sys
import time
from pathlib import Path

import httpx
import pytest
import yaml
from nginx_site import DEPLOY, STUDY, make_certificate, nginx_before
from scripted_workers import hello
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from benchmarks.support.play_server import PATIENCE
from benchmarks.support.ports import free_ports
from experiments.cli.main import parser


@pytest.fixture
def certificate(tmp_path):
    return make_certificate(tmp_path)


@pytest.fixture
def served(tmp_path, certificate):
    """URL of a study behind NGINX with TLS, and the folder of both."""
    front, behind = free_ports(2)
    (tmp_path / "study.toml").write_text(STUDY)
    url = f"https://localhost:{front}"
    words = ["--out", "out", "--port", str(behind), "--public-url", url, "--trusted-proxy", "127.0.0.1"]
    with (tmp_path / "log.txt").open("w") as log:
        study = subprocess.Popen(
            [sys.executable, "-m", "mjsim", "study", "serve", "study.toml", "--no-open", *words],
            cwd=tmp_path,
            stdout=log,
            stderr=log,
        )
        try:
            with nginx_before(tmp_path, [behind], front, certificate):
                yield url, tmp_path
        finally:
            study.terminate()
            study.wait()


@pytest.mark.slow
def test_a_visit_through_nginx_with_tls(served, certificate):
    url, folder = served
    trusted = ssl.create_default_context(cafile=certificate[0])
    asks = {"headers": {"Origin": url}, "follow_redirects": True, "timeout": PATIENCE}
    with httpx.Client(verify=trusted, base_url=url, **asks) as client:
        page = client.get("/")
        assert page.status_code == 200, page.text
        assert page.headers["strict-transport-security"]
        page = client.post("/begin", data={}, headers={"X-Forwarded-For": "192.0.2.1"})
        link = page.url.path
        assert client.post(link, data={"phase": "consent", "agree": "yes"}).status_code == 200
        page = client.get(link)
        assert 'data-trial="task"' in page.text
        static = re.search(r'"(/static/[0-9a-f]+/[^"]+\.js)"', page.text)[1]
        assert client.get(static).headers["cache-control"].endswith("immutable")
        assert client.get(static).status_code == 200
        assert client.post(link, data={}, headers={"Origin": "https://example.org"}).status_code == 403
        assert client.post(link, content=b"a" * 100_000).status_code == 413
    assert [path for path in (folder / "cache").rglob("*") if path.is_file()]  # NGINX keeps such files
    with connect(url.replace("http", "ws", 1) + link, ssl=trusted, origin=url) as socket:
        socket.send(json.dumps(hello("task")))
        assert json.loads(socket.recv(timeout=PATIENCE))["type"] == "state"
    with pytest.raises(InvalidStatus):
        connect(url.replace("http", "ws", 1) + link, ssl=trusted, origin="https://example.org")


@pytest.mark.parametrize("name", ["mjsim-study.service", "mjsim-backup.service"])
def test_units_are_valid_and_locked_in(tmp_path, name):
    if shutil.which("systemd-analyze") is None:
        pytest.skip("no systemd on this machine")
    text = (DEPLOY / "systemd" / name).read_text().replace("/opt/mjsim/bin/mjsim", sys.executable)
    (tmp_path / name).write_text(text)
    checked = subprocess.run(["systemd-analyze", "verify", tmp_path / name], capture_output=True, text=True)
    assert checked.returncode == 0, checked.stderr
    assert name not in checked.stderr  # what it says of this machine's other units is not ours
    exposure = ["systemd-analyze", "security", "--offline=yes", "--threshold=40", tmp_path / name]
    checked = subprocess.run(exposure, capture_output=True, text=True)
    assert checked.returncode == 0, checked.stdout


def command(text):
    """The words after `mjsim` of a command line."""
    words = shlex.split(text)
    return words[next(place for place, word in enumerate(words) if word.endswith("mjsim")) + 1 :]


def test_commands_are_those_of_this_version():
    unit = (DEPLOY / "systemd" / "mjsim-study.service").read_text()
    parser("study").parse_args(command(re.search(r"^ExecStart=(.*)$", unit, re.MULTILINE)[1]))
    backup = re.search(
        r"exec (/opt.*)'$", (DEPLOY / "systemd" / "mjsim-backup.service").read_text(), re.MULTILINE
    )
    parser("study").parse_args(command(backup[1]))
    compose = yaml.safe_load((DEPLOY / "container" / "compose.yaml").read_text())
    serve = re.sub(r"\$\{(\w+):\?\}", r"\1", compose["services"]["study"]["command"])
    parser("study").parse_args(["study", *shlex.split(serve)])


def test_the_image_gets_all_that_the_package_is_made_of():
    """Docker takes what is not ignored; hatchling needs the packages, the models and what pyproject.toml names."""
    ignored = (DEPLOY / "container" / "Containerfile.dockerignore").read_text().split()
    taken = {line[1:] for line in ignored if line.startswith("!")}
    project = Path(__file__).parents[2]
    assert all((project / name).exists() for name in taken)
    assert {
        "mjsim",
        "planner",
        "hud",
        "experiments",
        "models",
        "pyproject.toml",
        "README.md",
        "LICENSE",
    } <= taken


@pytest.mark.slow
def test_the_image_serves_a_study(tmp_path):
    docker = shutil.which("docker") or shutil.which("podman")
    if docker is None or subprocess.run([docker, "info"], capture_output=True).returncode:
        pytest.skip("no container engine runs on this machine")
    project = Path(__file__).parents[2]
    build = [
        docker,
        "build",
        "--file",
        DEPLOY / "container" / "Containerfile",
        "--tag",
        "mjsim-test",
        project,
    ]
    subprocess.run(build, check=True)
    (tmp_path / "study.toml").write_text(STUDY)
    mount = f"{tmp_path / 'study.toml'}:/study/study.toml:ro"
    made = subprocess.run(
        [docker, "run", "-d", "-v", mount, "mjsim-test"], check=True, capture_output=True, text=True
    )
    container = made.stdout.strip()
    try:
        asks = "from urllib.request import urlopen; print(urlopen('http://127.0.0.1:8000/').status)"
        until = time.monotonic() + PATIENCE
        while time.monotonic() < until:
            asked = subprocess.run(
                [docker, "exec", container, "python", "-c", asks], capture_output=True, text=True
            )
            if asked.stdout.strip() == "200":
                return
            time.sleep(1.0)
        pytest.fail(asked.stderr)
    finally:
        subprocess.run([docker, "rm", "-f", container], check=True, capture_output=True)
