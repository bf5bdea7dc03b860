"""Workers of the pool: none is left over."""

import asyncio
import threading

from experiments.web.server import pool as pools


def test_a_worker_that_nobody_waits_for_any_more_is_ended(monkeypatch):
    goes_on, ended = threading.Event(), threading.Event()

    class Slow:
        def __init__(self):
            goes_on.wait(10.0)

        async def connect(self):
            pass

        def end(self):
            ended.set()

    async def run():
        pool = pools.WorkerPool("apartment")
        starting = asyncio.create_task(pool.start())
        await asyncio.sleep(0.05)
        starting.cancel()
        await asyncio.gather(starting, return_exceptions=True)
        goes_on.set()
        while not ended.is_set():
            await asyncio.sleep(0.01)

    monkeypatch.setattr(pools, "WorkerProcess", Slow)
    asyncio.run(asyncio.wait_for(run(), 10.0))
    assert ended.is_set()
