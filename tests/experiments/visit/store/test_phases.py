"""Progress of a person: nothing is lost, repeated or changed after it was final."""

import asyncio
from datetime import timedelta

import pytest
from store_clock import at

from experiments.visit.store import Store

pytestmark = pytest.mark.anyio


async def values(store):
    return {(answer.phase, answer.item): (answer.value, answer.final) for answer in await store.answers()}


async def test_answers_are_kept_as_they_are_given_and_final_with_the_phase(store, arrive):
    person = await arrive()
    assert await store.save_answers(person.id, "consent", {"read": False, "age": 30})
    assert await store.save_answers(person.id, "consent", {"read": True})
    assert await values(store) == {("consent", "read"): (True, False), ("consent", "age"): (30, False)}
    assert await store.finish_phase(person.id, "consent", "story", {"age": 31, "name": None})
    assert await values(store) == {
        ("consent", "read"): (True, True),
        ("consent", "age"): (31, True),
        ("consent", "name"): (None, True),
    }


async def test_answers_of_everybody_to_one_item(store, arrive):
    for number in (1, 2, 3):
        person = await arrive(number)
        await store.save_answers(person.id, "consent", {"age": 30 + number, "read": True})
        if number < 3:
            await store.finish_phase(person.id, "consent", "story")
    assert [answer.value for answer in await store.answers_to("consent", "age")] == [31, 32]
    assert await store.answers_to("story", "age") == ()


async def test_a_phase_that_is_over_takes_no_answers_and_does_not_end_again(store, arrive):
    person = await arrive()
    assert await store.finish_phase(person.id, "consent", "story", {"read": True})
    assert not await store.save_answers(person.id, "consent", {"read": False})
    assert not await store.finish_phase(person.id, "consent", "task", {"read": False})
    assert (await store.person(person.id)).phase == "story"
    assert await values(store) == {("consent", "read"): (True, True)}


async def test_of_two_connections_that_send_a_form_at_once_one_wins(store, url, arrive):
    person = await arrive()
    other = await Store.open(url, "pilot", "0" * 64)
    try:
        for number in range(10):
            won = await asyncio.gather(
                *(
                    side.finish_phase(person.id, _name(number), f"phase {number + 1}", {"who": index})
                    for index, side in enumerate((store, other, store, other))
                )
            )
            assert sum(won) == 1
            assert (await values(store))[_name(number), "who"] == (won.index(True), True)
    finally:
        await other.close()


def _name(number):
    return f"phase {number}" if number else "consent"


async def test_when_a_phase_was_shown_first_counts(store, arrive):
    person = await arrive()
    with at(person.created):
        first = await store.show_phase(person.id, "consent")
    with at(person.created + timedelta(minutes=1)):
        assert await store.show_phase(person.id, "consent") == first
    end = person.created + timedelta(minutes=2)
    with at(end):
        assert await store.finish_phase(person.id, "consent", "story", reason="read")
    [phase] = await store.phases(person.id)
    assert (phase.duration_s, phase.reason, phase.ended) == (120.0, "read", end)


async def test_a_clock_that_steps_back_makes_no_negative_duration(store, arrive):
    person = await arrive()
    await store.show_phase(person.id, "consent")
    with at(person.created - timedelta(hours=1)):
        await store.finish_phase(person.id, "consent", "story")
    assert [phase.duration_s for phase in await store.phases()] == [0.0]


async def test_any_text_survives(store, arrive):
    person = await arrive()
    text = "é😀\u0000\ud800 '; DROP TABLE person; -- <script> =1+1" + "x" * 100_000
    await store.save_answers(person.id, "consent", {"text": text, "Text": [1, {"a": 0.1}]})
    assert await values(store) == {
        ("consent", "text"): (text, False),
        ("consent", "Text"): ([1, {"a": 0.1}], False),
    }


async def test_the_last_phase_ends_the_participation(store, arrive):
    person = await arrive()
    assert await store.finish_phase(person.id, "consent", "completion", status="finished")
    assert (await store.person(person.id)).status == "finished"
    assert not await store.finish_phase(person.id, "completion", "consent")
    assert not await store.save_answers(person.id, "completion", {"late": 1})


async def test_a_trial_is_noted_once(store, arrive):
    person = await arrive()
    await store.finish_trial(person.id, "task", "visits/a/task", "interrupted")
    await store.finish_trial(person.id, "task", "visits/a/task", "finished")
    [trial] = await store.trials(person.id)
    assert (trial.phase, trial.folder, trial.ended) == ("task", "visits/a/task", "finished")


async def test_who_withdraws_keeps_the_answers_or_has_them_deleted(store, arrive):
    first, second = await arrive(1), await arrive(2)
    for person in (first, second):
        await store.save_answers(person.id, "consent", {"age": 30})
    assert await store.withdraw(first.id, delete=False)
    assert not await store.withdraw(first.id, delete=False)
    assert await store.withdraw(second.id, delete=True)
    assert [answer.person_id for answer in await store.answers()] == [first.id]
    assert [person.delete_wanted for person in await store.people()] == [False, True]
    assert await store.withdraw(first.id, delete=True)
    assert await store.answers() == ()
