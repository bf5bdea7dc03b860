"""People who come at the same moment, over real HTTP to a real server process on each database."""

import asyncio
from collections import Counter
from itertools import product

import pytest

from benchmarks.support.study_people import arrive_at_once, study_process
from experiments.visit.store import Store


@pytest.mark.slow
@pytest.mark.long
def test_everybody_who_comes_at_once_gets_every_page_and_a_place_of_their_own(tmp_path, url):
    people = 500
    with study_process(tmp_path, "--database", url, people=people // 2) as server:
        times, links = asyncio.run(arrive_at_once(server.url, people))
    print({name: f"{max(seconds):.2f} s" for name, seconds in times.pages.items()})
    assert not times.failed
    assert len(set(links)) == people

    async def kept():
        store = await Store.open(url, "small", "0" * 64)
        try:
            return await store.assignments(), await store.people(), await store.answers()
        finally:
            await store.close()

    places, known, answers = asyncio.run(kept())
    assert sorted((one.cell, one.place) for one in places) == [
        (cell, place) for cell in (0, 1) for place in range(people // 2)
    ]
    assert Counter(one.person_id for one in places) == Counter(one.id for one in known)
    items = ("agreed", "text_version", "text_sha256")  # of the consent
    assert Counter((one.person_id, one.item) for one in answers) == Counter(
        product((one.id for one in known), items)
    )
    assert "Traceback" not in server.output.read_text()
