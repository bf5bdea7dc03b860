"""Find free ports on this machine for servers that need a fixed port."""

import random
import socket
from itertools import islice

BELOW_CLIENTS = range(15_000, 32_000)  # Linux assigns ports from 32768 to clients


def listens(port: int) -> bool:
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


def free_ports(number: int) -> list[int]:
    """Return ports that are currently free and that the system does not assign to clients."""
    drawn = random.SystemRandom().sample(BELOW_CLIENTS, len(BELOW_CLIENTS))
    return list(islice((port for port in drawn if not listens(port)), number))
