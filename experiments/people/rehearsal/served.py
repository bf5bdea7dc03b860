"""The study that a rehearsal serves: its people are marked as simulated, and its times are shorter."""

from dataclasses import replace

import msgspec

from experiments.people.study_file import Cell, Study
from experiments.record.origin import REHEARSAL


def rehearsed(study: Study, factor: float) -> Study:
    """A study whose people are simulated, and in which all waiting takes 1/`factor` of the time."""
    settings = study.settings
    away = ("abandoned_after", "timed_out_after")
    shorter = {name: getattr(settings.limits, name) / factor for name in away}
    limits = msgspec.structs.replace(settings.limits, **shorter)
    minimum = {name: seconds / factor for name, seconds in settings.minimum.items()}
    cells = [
        Cell([msgspec.structs.replace(trial, user=REHEARSAL) for trial in c.trials]) for c in study.cells
    ]
    settings = msgspec.structs.replace(settings, limits=limits, minimum=minimum)
    return replace(study, cells=cells, settings=settings, rehearsal=True)
