"""The command line, as `mjsim` or `python -m mjsim`."""

import importlib
import sys

from mjsim.support.environment import hidden_package


def main() -> int:
    """Run the command line; say so if other software hides the package that it lives in."""
    if hidden := hidden_package("experiments"):
        print(f"mjsim: {hidden}", file=sys.stderr)
        return 1
    return int(importlib.import_module("experiments.cli.main").main())


if __name__ == "__main__":
    sys.exit(main())
