"""Create the visit plan of a study, which defines the phases of a participant's visit."""

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import msgspec

from experiments.record.phases import REHEARSAL
from experiments.session.familiarise import with_names
from experiments.study.file import Study
from experiments.study.recruitment import recruiter
from experiments.trials.training import trials_of
from experiments.visit.plan import PLAYED, VisitPlan, VisitSettings
from experiments.visit.recruiter import Recruiter
from experiments.visit.store import Assignment, CellQuota
from experiments.web.worker.encoders import poster
from mjsim.formats.gltf.cache import view_path
from mjsim.formats.gltf.store import scenes_folder
from mjsim.generator.home_cache import load_catalogue


def plan_of(study: Study, film: Path | None = None, platform: Recruiter | None = None) -> VisitPlan:
    """Create the visit plan of a study. `film` is a video of the house. `platform` replaces the study's own.

    Raises:
        ConfigError: A setting that the platform requires is missing.
    """
    settings = study.settings
    platform = platform or recruiter(settings.recruitment)
    if study.rehearsal:
        platform.platform = REHEARSAL
    catalogue = load_catalogue(study.cells[0].trials[0].house)
    endless = {name: math.inf for name in PLAYED if name not in settings.optional}

    def trials(place: Assignment) -> Mapping[str, dict[str, Any]]:
        task = msgspec.structs.replace(
            study.cells[place.cell].trial(place.place),
            house_seed=place.house_seed,
            person_seed=place.person_seed,
            order_seed=place.order_seed,
        )
        return trials_of(task)

    shared = {name: getattr(settings, name) for name in VisitSettings.__struct_fields__}
    return VisitPlan(
        **shared | {"minimum": {**settings.minimum, **endless}},
        texts=study.texts,
        story=with_names(study.story, catalogue.in_language(settings.language)),
        cells=[
            CellQuota(len(cell.trials), [trial.house_seed for trial in cell.trials]) for cell in study.cells
        ],
        trials=trials,
        recruiter=platform,
        film=film,
        poster=poster(film) if film else "",
        picture=view_path(catalogue, scenes_folder()),
        rehearsal=study.rehearsal,
    )
