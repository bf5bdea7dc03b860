"""The pages, from templates in `pages/`; everything that is put into them is escaped."""

import html
from collections.abc import Mapping
from importlib import resources
from string import Template
from typing import Any

from starlette.responses import HTMLResponse

PLAN = "A numbered plan says what to do next, and red dots on your way lead there."
STORIES = {
    "none": "A list names the objects to find.",
    "highlight": "A list names the objects to find, and flagpoles stand over them, also through walls.",
    "guided": PLAN,
    "optimal": f"{PLAN} You may do something else; the plan then follows you.",
}


def page(name: str, title: str, *, status: int = 200, **values: object) -> HTMLResponse:
    """A page.

    Args:
        name: Of its template.
        title: Its title.
        status: HTTP status.
        values: What is put into the template.
    """
    body = _template(name).substitute({key: html.escape(str(value)) for key, value in values.items()})
    return HTMLResponse(_template("frame").substitute(title=html.escape(title), body=body), status)


def message_page(status: int, title: str, text: str) -> HTMLResponse:
    """A page that says something in two lines."""
    return page("message", title, status=status, title_text=title, text=text)


def story_page(trial: Mapping[str, Any]) -> HTMLResponse:
    """The first page: what the task is about."""
    count = trial["objects"]
    return page(
        "story",
        "Tidy the apartment",
        objects="1 object lies" if count == 1 else f"{count} objects lie",
        help=STORIES.get(str(trial["assistance"]).split("-")[0], "The display in front of you assists you."),
        carried="two objects, one in each hand" if trial["capacity"] == 2 else "one object",
    )


def play_page(phase: str, count: int) -> HTMLResponse:
    """The page on which a trial is played."""
    title = "Training" if phase == "training" else "Your task"
    return page("play", title, phase=phase, objects=count)


def result_page(link: str, metrics: Mapping[str, Any]) -> HTMLResponse:
    """What somebody achieved."""
    return page(
        "result",
        "Your result",
        plan=f"{link}/floor-plan.png",
        delivered=metrics["delivered"],
        objects=metrics["objects"],
        time=_duration(metrics["completion_time_s"]),
        walked=f"{metrics['task_distance_m']:.0f} m",
        ipl=f"{metrics['ipl_stand']:.2f}",
        extra=_metres(metrics["total_regret_m"]),
        visits=_visits(metrics),
    )


def _duration(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes} min {rest} s" if minutes else f"{rest} s"


def _metres(metres: float | None) -> str:
    return "not known" if metres is None else f"{metres:.1f} m"


def _visits(metrics: Mapping[str, Any]) -> str:
    count = metrics["regretful_visits"]
    if metrics["total_regret_m"] is None:
        return "No visit was made."
    if count == 0:
        return "Every visit was a best one at its moment."
    return f"{count} of your visits {'was' if count == 1 else 'were'} longer than need be."


def _template(name: str) -> Template:
    return Template((resources.files(__package__) / "pages" / f"{name}.html").read_text("utf-8"))
