"""Ports of this machine for servers that must be found, or start again, at a port known before."""

import random
import socket
from itertools import islice

BELOW_CLIENTS = range(
    15_000, 32_000
)  # Linux gives clients those from 32768; one of them may go at any moment


def listens(port: int) -> bool:
    """Whether a port of this machine takes connections."""
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


def free_ports(number: int) -> list[int]:
    """Ports of this machine that are free now, and that no client gets."""
    drawn = random.SystemRandom().sample(BELOW_CLIENTS, len(BELOW_CLIENTS))
    return list(islice((port for port in drawn if not listens(port)), number))
