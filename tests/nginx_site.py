"""NGINX with the configuration of `deploy/`, on this machine and with a certificate of its own."""

import re
import shutil
import subprocess
import time
from contextlib import contextmanager
from pathlib import Path

import pytest

from benchmarks.support.play_server import PATIENCE
from benchmarks.support.ports import listens

NGINX = shutil.which("nginx", path="/usr/sbin:/usr/bin:/usr/local/sbin:/usr/local/bin")
DEPLOY = Path(__file__).parents[1] / "deploy"
STUDY = """
[[cells]]
assistance = "none"
objects = 1
people = 2
house_seeds = 0
fidelity = "event"

[study]
name = "small"
title = "A small study"
institution = "a test"
contact = "nobody@example.org"
phases = ["consent", "task", "completion"]
"""
MAIN = """user root; daemon off; pid {0}/pid; error_log {0}/error.log; events {{}}
http {{ client_body_temp_path {0}/body; proxy_temp_path {0}/proxy; fastcgi_temp_path {0}/f; uwsgi_temp_path {0}/u;
  scgi_temp_path {0}/s; include {0}/mjsim.conf; }}
"""


def make_certificate(folder):
    """A certificate for localhost, and its key."""
    key, made = folder / "key.pem", folder / "made.pem"
    names = ["-subj", "/CN=localhost", "-addext", "subjectAltName=DNS:localhost"]
    command = ["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", *names]
    subprocess.run([*command, "-keyout", key, "-out", made], check=True, capture_output=True)
    return made, key


def site(folder, hosts, port, certificate):
    """The configuration for this machine."""
    text = (DEPLOY / "nginx" / "mjsim.conf").read_text()
    servers = "".join(f"    server 127.0.0.1:{host};\n" for host in hosts)
    for old, new in {
        "    server 127.0.0.1:8000;\n": servers,
        "/etc/letsencrypt/live/study.example.org/fullchain.pem": str(certificate[0]),
        "/etc/letsencrypt/live/study.example.org/privkey.pem": str(certificate[1]),
        "/var/cache/nginx-mjsim": f"{folder}/cache",
        "listen 443 ssl": f"listen 127.0.0.1:{port} ssl",
        "study.example.org": "localhost",
        "listen 80;": f"listen unix:{folder}/redirect;",  # port 80 may be taken; without any, NGINX takes it
    }.items():
        assert old in text
        text = text.replace(old, new)
    return re.sub(r"listen \[::\]:.*;", "", text)


@contextmanager
def nginx_before(folder, hosts, port, certificate):
    """NGINX at a port, before hosts at ports of theirs."""
    if NGINX is None or shutil.which("openssl") is None:
        pytest.skip("no NGINX or openssl on this machine")
    (folder / "mjsim.conf").write_text(site(folder, hosts, port, certificate))
    (folder / "nginx.conf").write_text(MAIN.format(folder))
    with (folder / "nginx.txt").open("w") as log:
        nginx = subprocess.Popen([str(NGINX), "-c", str(folder / "nginx.conf")], stderr=log)
    try:
        until = time.monotonic() + PATIENCE
        while not all(map(listens, (port, *hosts))) and time.monotonic() < until:
            time.sleep(0.05)
        yield
    finally:
        nginx.terminate()
        nginx.wait()
