"""Entry point of the `mjsim` command."""

import importlib
import sys

from mjsim.support.environment import hidden_package


def main() -> int:
    """Run the `mjsim` command. Print a message and return 1 if another package hides `experiments`."""
    if hidden := hidden_package("experiments"):
        print(f"mjsim: {hidden}", file=sys.stderr)
        return 1
    return int(importlib.import_module("experiments.cli.main").main())


if __name__ == "__main__":
    sys.exit(main())
