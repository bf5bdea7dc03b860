"""Workers of `mjsim play` that answer at once, and the messages of a page that plays with them."""

import asyncio
import json
import threading
from contextlib import contextmanager
from pathlib import Path

from experiments.record import records
from experiments.web.protocol import Inputs, Leave, Open, Pause, RunMessage, Saved, Taken
from experiments.web.state import State, Trigger

LAST = 100  # rows scrolled at once, with which a scripted trial ends as if all was delivered
ORIGIN = "http://127.0.0.1:8000"
METRICS = {
    "ended": "all delivered",
    "objects": 6,
    "delivered": 6,
    "completion_time_s": 125.0,
    "task_distance_m": 70.2,
    "ipl_locations": 0.93,
    "total_regret_m": 3.25,
    "regretful_visits": 2,
}


class ScriptedWorker:
    """Answers as a worker does, at once; keeps what it was told."""

    def __init__(self):
        self.told = []
        self._state = State()
        self._answers = asyncio.Queue()
        self._loop = asyncio.get_running_loop()

    def send(self, message):
        self.told.append(message)
        match message:
            case Open(run=run):
                self._run, self._state = Path(run), State()
                self._move(Trigger.OPENED)
            case RunMessage():
                self._move(Trigger.RUN)
            case Pause(reason):
                self._move(Trigger.PAUSE, reason)
            case Inputs(inputs):
                self._answers.put_nowait(Taken(inputs[-1].number, 1))
                if inputs[-1].scroll == LAST:
                    self._end()
            case Leave():
                self._end()

    def _end(self):
        self._run.mkdir()
        (self._run / records.METRICS).write_text(json.dumps(METRICS))
        self._move(Trigger.END, "all delivered")
        self._answers.put_nowait(Saved())

    def _move(self, trigger, reason=""):
        self._state = self._state.after(trigger, reason)
        self._answers.put_nowait(self._state)

    def say(self, message):
        self._loop.call_soon_threadsafe(self._answers.put_nowait, message)

    def die(self):
        self.say(None)

    async def receive(self):
        return await self._answers.get()


class ScriptedPool:
    """Gives scripted workers; `workers` holds those given."""

    def __init__(self):
        self.workers = []
        self.discarded = []
        self.given = threading.Condition()

    async def start(self):
        with self.given:
            self.workers.append(ScriptedWorker())
            self.given.notify_all()
        return self.workers[-1]

    def discard(self, worker):
        self.discarded.append(worker)

    async def close(self):
        pass


def hello(trial="training", tab="tab-00000001"):
    view = {"type": "view", "width": 640, "height": 480, "codec": "none"}
    return {"type": "hello", "tab": tab, "trial": trial, "view": view}


@contextmanager
def connected(client, link, origin=ORIGIN):
    with client.websocket_connect(link, headers={"Origin": origin, "Host": "127.0.0.1:8000"}) as socket:
        yield socket


def until(socket, kind):
    """Messages up to the first one of a type."""
    said = []
    while not said or said[-1]["type"] != kind:
        said.append(socket.receive_json())
    return said


def until_phase(socket, phase):
    """The first state with a phase."""
    while (state := until(socket, "state")[-1])["phase"] != phase:
        pass
    return state


def started(socket, trial="training", **kw):
    socket.send_json(hello(trial, **kw))
    until_phase(socket, "ready")
    socket.send_json({"type": "run"})
    return until_phase(socket, "running")


def left(socket):
    socket.send_json({"type": "leave"})
    until(socket, "saved")


def play_trial(client, link, trial):
    """Start a trial and go through it."""
    with connected(client, link) as socket:
        started(socket, trial)
        socket.send_json({"type": "inputs", "inputs": [{"number": 1, "scroll": LAST}]})
        until(socket, "saved")
