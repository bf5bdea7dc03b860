"""The network of a simulated browser, which may be slow and lossy and counts bytes."""

from dataclasses import dataclass

import numpy as np
from websockets.asyncio.client import ClientConnection

RETRANSMISSION_S = 0.2  # delay until TCP retransmits a lost packet


@dataclass(frozen=True)
class Link:
    """A network between browser and server with the same properties in both directions.

    Attributes:
        latency: Delay of a message, s.
        jitter: Standard deviation of the additional delay, s.
        loss: Share of messages that are lost and retransmitted.
    """

    latency: float = 0.0
    jitter: float = 0.0
    loss: float = 0.0

    def delay(self, rng: np.random.Generator) -> float:
        lost = RETRANSMISSION_S * (rng.geometric(1.0 - self.loss) - 1) if self.loss else 0.0
        return self.latency + abs(float(rng.normal(0.0, self.jitter))) + float(lost)


class CountingConnection(ClientConnection):
    """A connection that counts the bytes that arrive."""

    received = 0

    def data_received(self, data: bytes) -> None:
        self.received += len(data)
        super().data_received(data)
