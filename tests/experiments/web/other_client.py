"""A client of `mjsim play`, written by docs/protocol.md alone; it follows the breadcrumbs, and draws nothing."""

import asyncio
import json
import math
import time
from contextlib import suppress

import httpx
from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed

STEP = 0.04  # s
NEAR = 0.35  # m from a breadcrumb from which the next one counts
ALIGNED = 0.5  # rad off the way within which one walks
PRESS_EVERY = 25  # control steps


def begin_visit(url):
    """Begin a visit; its link."""
    with httpx.Client(base_url=url, headers={"Origin": url.rstrip("/")}, timeout=60.0) as client:
        return str(client.post("/begin", follow_redirects=True).raise_for_status().url)


class OtherClient:
    """Plays the task of a visit that has no other phase, over a link that delays what it sends and gets, s.

    Attributes:
        snapshots: Control step -> the state with which it began.
        stamps: Number of an input -> the control step for which it was made.
        refused: Messages `error`.
        models: Instance name -> model, of all objects that it has seen.
        known: What it may draw now: poses by instance name.
    """

    def __init__(self, address, delay=0.0):
        self._address, self._delay = address, delay
        self._markers, self._reach, self._phase, self._scene = [], None, "", None
        self._saved = asyncio.Event()
        self._step = self._number = self._pressed = 0
        self._outgoing = asyncio.Queue()
        self.snapshots, self.stamps, self.refused, self.models, self.known = {}, {}, [], {}, {}

    async def play(self):
        """Play until the run directory has been written."""
        place = self._address.removeprefix("http")
        async with connect(f"ws{place}", origin=f"http{place.split('/play/')[0]}") as socket:
            tasks = [asyncio.create_task(doing(socket)) for doing in (self._send_all, self._receive_all)]
            view = {"type": "view", "width": 1280, "height": 720, "codec": "none"}
            self._say(type="hello", tab="other-client-0", trial="task", view=view)
            await self._until(lambda: self._phase == "ready" and self._scene)
            self._say(type="run", until=0)
            await self._until(lambda: self.snapshots)
            self._step, began = min(self.snapshots), time.perf_counter()
            first = self._step
            while not self._saved.is_set() and self._phase != "over":
                self._take_step()
                due = began + (self._step - first) * STEP
                await asyncio.sleep(max(0.0, due - time.perf_counter()))
            await asyncio.wait_for(self._saved.wait(), 60.0)
            for task in tasks:
                task.cancel()

    async def load(self):
        """The scene's files: `scene.json` and all that it names, and the floor, by name."""
        base = self._address.split("/play/")[0]
        async with httpx.AsyncClient(base_url=base, timeout=60.0) as client:

            async def get(path):
                return (await client.get(path)).raise_for_status()

            folder = self._scene["path"]
            scene = (await get(f"{folder}scene.json")).json()
            names = ["house.glb", "person.glb", *(model["file"] for model in scene["objects"].values())]
            found = {name: (await get(folder + name)).content for name in names}
            return {**found, "floor": (await get(self._scene["floor"])).json()}

    def _say(self, **message):
        self._outgoing.put_nowait((time.perf_counter() + self._delay, message))

    def _take_step(self):
        """Make the input of a control step, and promise that there is no other one for it."""
        inputs = []
        if (values := self._wish()) is not None:
            self._number += 1
            self.stamps[self._number] = self._step
            inputs.append({"number": self._number, "step": self._step, **values})
        self._step += 1
        self._say(type="inputs", inputs=inputs, until=self._step)

    def _wish(self):
        """What to press, as seen in the newest state."""
        state = self.snapshots[max(self.snapshots)]
        if state["busy"]:
            return None
        if self._reach is not None and self._step - self._pressed > PRESS_EVERY:
            self._pressed = self._step
            return {"press": "act"}
        (x, y, heading), path = (
            state["body"][:3],
            [m["position"] for m in self._markers if m["role"] == "breadcrumb"],
        )
        path += [m["position"] for m in self._markers if m["role"] == "goal"]
        if not path or self._reach is not None:
            return {}
        nearest = min(range(len(path)), key=lambda i: math.dist(path[i][:2], (x, y)))
        ahead = next((p for p in path[nearest:] if math.dist(p[:2], (x, y)) > NEAR), path[-1])
        turn = math.atan2(ahead[1] - y, ahead[0] - x) - heading
        turn = (turn + math.pi) % (2.0 * math.pi) - math.pi
        return {"forward": float(abs(turn) < ALIGNED), "turn": max(-1.0, min(1.0, 2.0 * turn))}

    async def _until(self, holds):
        async with asyncio.timeout(60.0):
            while not holds():
                await asyncio.sleep(0.005)

    async def _send_all(self, socket):
        with suppress(ConnectionClosed):
            while True:
                due, message = await self._outgoing.get()
                await asyncio.sleep(max(0.0, due - time.perf_counter()))
                await socket.send(json.dumps(message))

    async def _receive_all(self, socket):
        arriving = asyncio.Queue()
        taking = asyncio.create_task(self._take_all(arriving))
        with suppress(ConnectionClosed):
            async for text in socket:
                arriving.put_nowait((time.perf_counter() + self._delay, json.loads(text)))
        await taking

    async def _take_all(self, arriving):
        while True:
            due, message = await arriving.get()
            await asyncio.sleep(max(0.0, due - time.perf_counter()))
            self._take(message)

    def _take(self, message):
        match message["type"]:
            case "state":
                self._phase = message["phase"]
            case "scene":
                self._scene = message
            case "snapshot":
                self.snapshots[message["step"]] = message
                self.models |= message["models"]
                self.known |= message["objects"]
                for name in message["gone"]:
                    del self.known[name]
            case "markers":
                self._markers = message["markers"]
            case "moment":
                self._reach = message["reach"]
            case "beat":
                self._say(type="beat")
            case "error":
                self.refused.append(message)
            case "saved":
                self._saved.set()
