"""Which picture a person saw, from the event log: medians of what the page measured every 5 s (docs/metrics.md)."""

import statistics
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

from experiments.record.records import Event


@dataclass(frozen=True)
class Displays:
    """How well a person saw a trial: medians of its events `display`; only where there are any.

    Attributes:
        drawn_by_browser: Share of the time in which the browser drew; otherwise it showed frames of the server.
        display_renderer: What drew the picture most of the time.
        display_width: Width of the view, px of the page.
        display_height: Its height, px of the page.
        display_pixel_ratio: How many px of the screen one px of the page has.
        display_frames_per_s: Pictures shown a second.
        display_frame_ms_95: Of the times between two pictures, 95 % were shorter.
        display_latency_ms: From an input to the picture that shows it; None where nothing was pressed.
        display_dropped: Share of the pictures that came and were not shown.
        display_field_of_view: Horizontal field of view of the picture, rad; None where the person could not choose it.
    """

    drawn_by_browser: float
    display_renderer: str
    display_width: float
    display_height: float
    display_pixel_ratio: float
    display_frames_per_s: float
    display_frame_ms_95: float
    display_latency_ms: float | None
    display_dropped: float
    display_field_of_view: float | None


def displays(events: Sequence[Event]) -> dict[str, Any]:
    """The columns of `Displays` of an event log; empty where no page measured anything."""
    told = [event for event in events if event["event"] == "display"]
    if not told:
        return {}

    def median(name: str) -> float:
        return float(statistics.median(event[name] for event in told))

    shown = sum(5.0 * event["frames_per_s"] for event in told)
    dropped = sum(event["dropped"] for event in told)
    waits = [event["latency_ms"] for event in told if event["latency_ms"] is not None]
    angles = [angle for event in told if (angle := event.get("field_of_view")) is not None]
    found = Displays(
        drawn_by_browser=sum(event.get("draw") == "browser" for event in told) / len(told),
        display_renderer=statistics.mode(event["renderer"] for event in told),
        display_width=median("width"),
        display_height=median("height"),
        display_pixel_ratio=median("pixel_ratio"),
        display_frames_per_s=median("frames_per_s"),
        display_frame_ms_95=median("frame_ms_95"),
        display_latency_ms=float(statistics.median(waits)) if waits else None,
        display_dropped=dropped / (shown + dropped) if dropped else 0.0,
        display_field_of_view=float(statistics.median(angles)) if angles else None,
    )
    return asdict(found)
