"""A connection that does not keep up: each snapshot counts on the one before, so that none may be left out."""

import asyncio
import json

import pytest

from experiments.web import protocol
from experiments.web.server.browser_socket import MAX_WAITING, BrowserSocket
from experiments.web.state import Snapshot


class StalledSocket:
    """Takes nothing until all has been sent."""

    def __init__(self):
        self.texts, self.closed = [], None

    async def send_text(self, text):
        self.texts.append(json.loads(text))

    async def close(self, code, reason):
        self.closed = code, reason


def snapshot(step):
    return Snapshot(
        step=step,
        input=0,
        time=0.04 * step,
        busy=None,
        body=[0.0] * 16,
        eye=[0.0] * 5,
        hands=[],
        held=[],
        objects={f"object_{step}": [0.0] * 7},
        models={f"object_{step}": "mug"},
        gone=[],
    )


@pytest.mark.parametrize(
    ("count", "closed"), [(100, (1000, "")), (MAX_WAITING + 5, (protocol.SLOW, "too slow"))]
)
def test_every_snapshot_is_sent_or_the_connection_ends(count, closed):
    async def send():
        stalled = StalledSocket()
        socket = BrowserSocket(stalled)
        for step in range(count):
            socket.send(snapshot(step))
        socket.close(1000, "")
        await socket._send_all()
        return stalled

    stalled = asyncio.run(send())
    assert [text["step"] for text in stalled.texts] == list(range(min(count, MAX_WAITING)))
    assert stalled.closed == closed
