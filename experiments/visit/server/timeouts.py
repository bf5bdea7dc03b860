"""People who never return: their participation ends, and their places go to others."""

import asyncio
import datetime
import logging
import time

from experiments.errors import StoreError
from experiments.visit.procedure import Procedure
from experiments.visit.store import utc_now

LOG = logging.getLogger("mjsim.study")
SWEEP_PERIOD = 60.0  # s between two looks for people who never return
CLOCK_SET = 30.0  # s by which the clock is off once it was set, or the machine slept


async def end_absent(procedure: Procedure) -> None:
    """Time out participants who do not return. Time in which this server did not run does not count."""
    away = procedure.plan.limits.timed_out_after
    since = time.monotonic()
    ahead = time.time() - since
    while True:
        await asyncio.sleep(SWEEP_PERIOD)
        now = time.monotonic()
        if abs(time.time() - now - ahead) > CLOCK_SET:  # signs of life are noted by that clock
            since, ahead = now, time.time() - now
        if now - since < away:
            continue
        try:
            gone = await procedure.store.time_out(utc_now() - datetime.timedelta(seconds=away))
            if gone:
                LOG.info("%d participants did not return", gone)
        except StoreError as error:  # the next sweep may find them
            LOG.warning("%s", error)
