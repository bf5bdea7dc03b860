"""People who never return: their participation ends, and their places go to others."""

import asyncio
import datetime
import logging
import time
from collections.abc import Callable
from contextlib import AbstractAsyncContextManager

from experiments.errors import StoreError
from experiments.people.server.procedure import Procedure
from experiments.people.store import Person, utc_now
from experiments.people.study_file import PLAYED

LOG = logging.getLogger("mjsim.study")
SWEEP_PERIOD = 60.0  # s between two looks for people who never return
CLOCK_SET = 30.0  # s by which the clock is off once it was set, or the machine slept
LockOf = Callable[[Person], AbstractAsyncContextManager[None]]


async def end_absent(procedure: Procedure, lock_of: LockOf) -> None:
    """End the participation of people who never return. Time in which this server did not run does not count.

    `lock_of` gives what is held while a person's phase changes.
    """
    away = procedure.study.settings.limits.timed_out_after
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
            await _end_before(utc_now() - datetime.timedelta(seconds=away), procedure, lock_of)
        except StoreError as error:  # the next sweep may find them
            LOG.warning("%s", error)


async def _end_before(before: datetime.datetime, procedure: Procedure, lock_of: LockOf) -> None:
    """End the participation of people of whom there is no sign of life since then.

    A trial that was over when its page was closed is noted; its person may still answer the survey.
    """
    for person in await procedure.store.people():
        if person.active and person.seen < before and person.phase in PLAYED:
            async with lock_of(person):
                await procedure.after_trials(person)
    if gone := await procedure.store.time_out(before):
        LOG.info("%d people did not return", gone)
