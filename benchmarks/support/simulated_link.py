"""The network of a simulated browser: it may be slow and lossy, and it counts bytes."""

from dataclasses import dataclass

import numpy as np
from websockets.asyncio.client import ClientConnection

RETRANSMISSION_S = 0.2  # delay of a lost packet until TCP sends it again


@dataclass(frozen=True)
class Link:
    """A network between browser and server, which treats both directions alike.

    Attributes:
        latency: Of a message, s.
        jitter: Standard deviation of the additional delay, s.
        loss: Share of messages that are lost and sent again.
    """

    latency: float = 0.0
    jitter: float = 0.0
    loss: float = 0.0

    def delay(self, rng: np.random.Generator) -> float:
        """Draw the delay of a message, s."""
        lost = RETRANSMISSION_S * (rng.geometric(1.0 - self.loss) - 1) if self.loss else 0.0
        return self.latency + abs(float(rng.normal(0.0, self.jitter))) + float(lost)


class CountingConnection(ClientConnection):
    """A connection that counts the bytes that arrive."""

    received = 0

    def data_received(self, data: bytes) -> None:
        """Count the bytes, and handle them."""
        self.received += len(data)
        super().data_received(data)
