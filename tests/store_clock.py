"""The time of a store, set by a test."""

from contextlib import ExitStack, contextmanager
from types import SimpleNamespace
from unittest.mock import patch

from experiments.visit.store import hosts, ledger, values


@contextmanager
def at(moment):
    """Let the clocks of this process and of its database show a moment. None leaves them as they are."""

    async def database_now(_):
        return moment

    with ExitStack() as patches:
        if moment is not None:
            patches.enter_context(patch.object(values, "datetime", SimpleNamespace(now=lambda _: moment)))
            for module in (hosts, ledger):
                patches.enter_context(patch.object(module, "database_now", database_now))
        yield
