"""A worker that lost its server is found by the next one, in the folder of its session."""

import itertools
import socket
import stat
import threading
import time

from experiments.web.rejoining import SOCKET, ask, wait_for_server


def test_worker_and_server_meet_in_a_folder_with_a_long_name(tmp_path):
    folder = tmp_path / ("x" * 120)  # the address of a socket has some hundred bytes
    folder.mkdir()
    (folder / SOCKET).touch()  # as a worker that was killed leaves it
    found = []
    waiting = threading.Thread(target=lambda: found.append(wait_for_server(folder, lambda: True)))
    waiting.start()
    until = time.monotonic() + 20.0
    while (server := ask(folder)) is None:
        assert time.monotonic() < until
        time.sleep(0.01)
    waiting.join()
    (worker,) = found
    with server, worker:
        server.sendall(b"open")
        assert worker.recv(4) == b"open"
    assert not list(folder.iterdir()), "there is nobody to ask any more"


def test_only_the_user_of_the_server_can_ask(tmp_path):
    modes = []

    def look():
        modes.append(stat.S_IMODE((tmp_path / SOCKET).stat().st_mode))
        return False

    assert wait_for_server(tmp_path, look) is None
    assert modes == [0o600]


def test_a_worker_waits_only_while_there_is_a_session(tmp_path):
    looks = itertools.count()
    assert wait_for_server(tmp_path, lambda: next(looks) < 2) is None
    assert next(looks) == 3


def test_nobody_is_found_where_nobody_waits(tmp_path):
    assert ask(tmp_path) is None
    assert ask(tmp_path / "missing") is None
    with socket.socket(socket.AF_UNIX) as dead:
        dead.bind(str(tmp_path / SOCKET))
    assert ask(tmp_path) is None
