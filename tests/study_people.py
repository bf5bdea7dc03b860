"""Tables of made-up people, for tests of the analysis of studies."""

import numpy as np

from experiments.analysis.study.measures import read_measures
from experiments.analysis.study.table import study_table
from studies.published import read_published

SIZES = read_published().people.sizes()  # of the published study
MEANS = {"none": 0.75, "highlight": 0.65, "optimal": 0.3}


def made_up_people(sizes=SIZES, seed=0, **same):
    """A row per person; deviations, path length and distance follow the published directions."""
    rng, rows = np.random.default_rng(seed), []
    for (assistance, objects), count in sizes.items():
        for _ in range(count):
            k, spread = len(rows), 0.1 if assistance != "optimal" else 0.2
            level = (objects - 6) / 18
            deviations = np.clip(MEANS[assistance] + 0.2 * level + rng.normal(0, spread), 0, 1)
            rows.append(
                {"objects": objects, "assistance": assistance, "user": "follower", "house": "apartment"}
                | {"house_seed": k % 7, "person_seed": k, "order_seed": k, "ended": "all delivered"}
                | {
                    "nd_feasible": float(deviations),
                    "nd_strict_2n": round(deviations * 2 * objects) / (2 * objects),
                    "ipl_locations": float(1.1 - 0.5 * MEANS[assistance] + rng.normal(0, 0.15)),
                    "task_distance_m": max(
                        0.0, float(objects * (5 + 4 * MEANS[assistance]) + rng.normal(0, 12))
                    ),
                    "completion_time_s": float(30 * objects + rng.normal(0, 40)),
                }
                | same
            )
    return rows


def of_measures(rows, *kept):
    """Rows without the other measures, of each of which a report draws figures, which takes long."""
    others = {"nd_feasible", "nd_strict_2n", "ipl_locations", "task_distance_m", "completion_time_s"} - {
        *kept
    }
    return [{name: value for name, value in row.items() if name not in others} for row in rows]


def table_of(rows):
    return study_table(rows, read_measures(), "here")
