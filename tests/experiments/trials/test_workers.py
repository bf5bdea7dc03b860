"""Processes of a batch."""

import os
import signal
import threading
import time
from concurrent.futures import Future, ProcessPoolExecutor

import pytest

from experiments.session.signals import Stopped, signals_raised
from experiments.trials.workers import worker_pool


def test_a_signal_waits_until_a_process_has_started(monkeypatch):
    """A process that starts while its parent stops would print a traceback. The other thread takes the signal."""
    started, end = [], threading.Event()

    def submit(*_):
        os.kill(os.getpid(), signal.SIGTERM)
        time.sleep(0.1)
        started.append(True)
        return Future()

    monkeypatch.setattr(ProcessPoolExecutor, "submit", submit)
    threading.Thread(target=end.wait, daemon=True).start()
    with signals_raised(), worker_pool(1) as pool:
        with pytest.raises(Stopped):
            pool.submit(print)
        assert started == [True]
    end.set()
