"""The health of the physics over one trial, from the event log and the trajectory alone (docs/metrics.md)."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from experiments.record.columns import HEALTH
from experiments.record.records import Event
from mjsim.values.actions import EventKind

# Name in the metrics -> kind of event.
COUNTED = {
    "ejections": EventKind.EJECTED,
    "tunnellings": EventKind.TUNNELLED,
    "grips_lost": EventKind.GRIP_LOST,
}


def summarise_health(events: Sequence[Event], arrays: Mapping[str, NDArray[Any]]) -> dict[str, float | int]:
    """Maximum, 99th percentile and mean of every quantity, and counts of faults.

    Weld errors count where a hand carried something, settling times once per release, penetration at every control
    step. All are 0 where there is nothing to count.

    Args:
        events: The event log.
        arrays: The trajectory, columns as in `TRAJECTORY_COLUMNS`.

    Returns:
        Rows of `metrics.json`, such as `max_weld_error_m`.
    """
    summary: dict[str, float | int] = {}
    for name in HEALTH:
        values = arrays[name][~np.isnan(arrays[name])]
        for label, value in (
            ("max", values.max(initial=0.0)),
            ("p99", np.percentile(values, 99) if values.size else 0.0),
            ("mean", values.mean() if values.size else 0.0),
        ):
            summary[f"{label}_{name}"] = float(value)
    summary["releases_settled"] = int(np.count_nonzero(~np.isnan(arrays["settle_s"])))
    for name, kind in COUNTED.items():
        summary[name] = sum(event["event"] == kind.value for event in events)
    return summary
