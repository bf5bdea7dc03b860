"""The queue for a place."""

import asyncio

from experiments.web.server.limit import SessionLimit


def test_a_place_is_not_lost_to_somebody_who_has_just_left_the_queue():
    async def run():
        limit = SessionLimit(1)
        await limit.acquire("first", lambda _: None)
        leaves = asyncio.create_task(limit.acquire("second", lambda _: None))
        stays = asyncio.create_task(limit.acquire("third", lambda _: None))
        await asyncio.sleep(0)
        leaves.cancel()
        limit.release("first")
        await asyncio.wait_for(stays, 1.0)
        assert leaves.cancelled()

    asyncio.run(run())
