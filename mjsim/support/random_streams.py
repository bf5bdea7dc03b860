"""A random stream for each purpose and room, so that a new chair changes no plan."""

import hashlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np


def stream(seed: int, *purpose: str) -> "np.random.Generator":
    """The generator of a purpose, such as `stream(7, "furniture", "bedroom")`: the same in every process and order."""
    import numpy as np  # here, as names of houses are read before anything is simulated: --help starts fast

    digest = hashlib.sha256("/".join(purpose).encode()).digest()
    words = [int.from_bytes(digest[i : i + 4], "little") for i in range(0, 16, 4)]
    return np.random.default_rng(np.random.SeedSequence([seed, *words]))
