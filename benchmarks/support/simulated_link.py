"""Simulate a network connection that may be slow and lossy, and count the received bytes."""

from dataclasses import dataclass

import numpy as np
from websockets.asyncio.client import ClientConnection

RETRANSMISSION_S = 0.2  # delay after which TCP sends a lost packet again


@dataclass(frozen=True)
class Link:
    """A simulated network between a browser and the server, with the same properties in both directions.

    Attributes:
        latency: Delay of a message in seconds.
        jitter: Standard deviation of an additional delay in seconds.
        loss: Share of messages that are lost and sent again.
    """

    latency: float = 0.0
    jitter: float = 0.0
    loss: float = 0.0

    def delay(self, rng: np.random.Generator) -> float:
        lost = RETRANSMISSION_S * (rng.geometric(1.0 - self.loss) - 1) if self.loss else 0.0
        return self.latency + abs(float(rng.normal(0.0, self.jitter))) + float(lost)


class CountingConnection(ClientConnection):
    """A connection that counts the bytes that it receives."""

    received = 0

    def data_received(self, data: bytes) -> None:
        self.received += len(data)
        super().data_received(data)
