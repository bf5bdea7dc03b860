"""The course of a visit, without a server."""

import asyncio
import datetime

import numpy as np
import pytest

from experiments.study.file import read_people_study
from experiments.study.plan import plan_of
from experiments.trials.designs import FOLDER
from experiments.visit.folders import VisitFolders
from experiments.visit.procedure import Procedure
from experiments.visit.store import Store, utc_now


@pytest.mark.parametrize(
    ("here", "wanted"),
    [("debriefing", ("finished", "completion", "finished")), ("survey", ("timed_out", "survey", "released"))],
)
def test_a_tab_that_is_closed_on_the_debriefing_page_costs_neither_pay_nor_place(tmp_path, here, wanted):
    async def run():
        store = await Store.open(f"sqlite:///{tmp_path / 'study.db'}", "study", "0" * 64)
        procedure = Procedure(
            plan_of(read_people_study(FOLDER / "paper.toml")),
            store,
            VisitFolders(tmp_path / "visits"),
            np.random.default_rng(0),
        )
        person = await store.arrive("link", None, {}, "1" * 64, here)
        await procedure.assign(person)
        await procedure.recover()
        assert (await store.person(person.id)).active, "a server that starts ends no visit"
        later = utc_now() + datetime.timedelta(hours=1)
        await procedure.recover(later)
        await store.time_out(later)
        person, place = await store.person(person.id), await store.assignment(person.id)
        await store.close()
        return person.status, person.phase, place.state

    assert asyncio.run(run()) == wanted
