"""Statistics of studies between subjects, on plain arrays; statsmodels and scipy do the arithmetic.

statsmodels comes with the extra `study`, which `require_statsmodels` says where it is missing.
"""

import importlib.util

from experiments.errors import ConfigError

EXTRA = "study"


def require_statsmodels() -> None:
    """Check that the extra is there, before anything is read or computed.

    Raises:
        ConfigError: It is not; the message says how to install it.
    """
    if importlib.util.find_spec("statsmodels") is None:
        raise ConfigError(
            f"this needs statsmodels, which is not installed: pip install 'mjsim[{EXTRA}]' adds it"
        )
