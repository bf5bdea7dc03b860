"""Run trials with a short and a tall person in generated homes, and count lost grips and deep penetrations."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from benchmarks.support.requirements import Requirement, requirement_lines
from experiments.house import House
from experiments.participants.distribution import Distributions
from experiments.record.phases import ALL_DELIVERED
from experiments.record.records import EventLog
from experiments.trials.setup import draw_person, prepare_session, trial_episode
from experiments.trials.trial_config import TrialConfig
from mjsim.house.scene.scene import compose
from mjsim.values.actions import EventKind

OBJECTS = 12
TIME_LIMIT = 600.0  # simulated time in seconds after which a trial ends; most trials take about 100 s
# The 5th percentile of women and the 95th percentile of men (Pheasant and Haslegrave, Bodyspace, 2006). The reach and
# the radius of the body are larger or smaller by about the same share.
PEOPLE: Mapping[str, Mapping[str, float]] = {
    "short": {"eye_height": 1.405, "reach": 0.9, "body_radius": 0.18},
    "tall": {"eye_height": 1.745, "reach": 1.1, "body_radius": 0.23},
}
REQUIREMENTS = (
    Requirement("trials with objects left", "unfinished", "<=", 0),
    Requirement("lost grips in a trial, most", "lost_max", "<=", 1),
    Requirement("penetration, deepest, mm", "penetration_max_mm", "<=", 10.0),
)


def trials(home: tuple[int, int]) -> list[dict[str, Any]]:
    """Run one trial per person in a home of a size and a seed. Return the result of each trial."""
    rooms, seed = home
    name = f"generated:{seed}?rooms={rooms}"
    house = House.load(name)
    return [{"home": name, "person": key, **_run(house, seed, person)} for key, person in PEOPLE.items()]


def _run(house: House, seed: int, person: Mapping[str, float]) -> dict[str, Any]:
    config = TrialConfig(
        objects=min(OBJECTS, house.catalogue.points or OBJECTS),
        assistance="optimal",
        house=house.catalogue.name,
        seed=seed,
        regret=False,
        time_limit=TIME_LIMIT,
        person=Distributions.of(person),
    )
    house = house.for_person(draw_person(config))
    scene, log = compose(trial_episode(config, house), house.catalogue, person=house.person), EventLog()
    session, world = prepare_session(config, house, scene, log)
    return {
        "finished": session.run() == ALL_DELIVERED,
        "time_s": session.progress.time,
        "lost": sum(event["event"] == EventKind.GRIP_LOST.value for event in log.events),
        "penetration_mm": 1000.0 * world.health.max_penetration_m,
    }


def trial_lines(rows: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """Yield each trial with a lost grip or another problem, then the requirements."""
    for row in rows:
        if not row["finished"] or row["lost"] or row["penetration_mm"] > REQUIREMENTS[-1].bound:
            yield (
                f"{row['home']}, {row['person']}: {'finished' if row['finished'] else 'unfinished'} after "
                f"{row['time_s']:.0f} s, {row['lost']} lost grips, {row['penetration_mm']:.1f} mm"
            )
    summary = {
        "unfinished": sum(not row["finished"] for row in rows),
        "lost_max": max(row["lost"] for row in rows),
        "penetration_max_mm": max(row["penetration_mm"] for row in rows),
    }
    yield f"{len(rows)} trials of {OBJECTS} objects, {sum(row['lost'] for row in rows)} lost grips"
    yield from requirement_lines(summary, REQUIREMENTS)
