"""One stream of chance for each purpose and room, so that a new chair changes no plan."""

import hashlib

import numpy as np


def stream(seed: int, *purpose: str) -> np.random.Generator:
    """The generator of a purpose, such as `stream(7, "furniture", "bedroom")`: the same in every process and order."""
    digest = hashlib.sha256("/".join(purpose).encode()).digest()
    words = [int.from_bytes(digest[i : i + 4], "little") for i in range(0, 16, 4)]
    return np.random.default_rng(np.random.SeedSequence([seed, *words]))
