"""The pages, from the files in `templates/`; everything that is put into them is escaped."""

import html
import time
from collections.abc import Mapping
from importlib import resources
from string import Template
from typing import Any

from starlette.responses import HTMLResponse

PLAN = "A numbered plan says what to do next, and red dots on your way lead there."
HELP = {
    "none": "A list names the objects to find.",
    "highlight": "A list names the objects to find, and flagpoles stand over them, also through walls.",
    "guided": PLAN,
    "optimal": f"{PLAN} You may do something else; the plan then follows you.",
}
TRAINING = "You begin with a short training: one object, and all the time you like."


def page(name: str, title: str, *, status: int = 200, **values: object) -> HTMLResponse:
    """A page.

    Args:
        name: Of its template.
        title: Its title.
        status: HTTP status.
        values: What is put into the template; of a list, each item becomes a paragraph.
    """
    body = _template(name).substitute({key: _escaped(value) for key, value in values.items()})
    return HTMLResponse(_template("frame").substitute(title=html.escape(title), body=body), status)


def message_page(status: int, title: str, text: str) -> HTMLResponse:
    """A page that says something in two lines."""
    return page("message", title, status=status, title_text=title, text=text)


def story_page(story: str, trial: Mapping[str, Any], *, training: bool) -> HTMLResponse:
    """The first page: what the task is about.

    Args:
        story: Its text, with blank lines between paragraphs.
        trial: Settings of the task.
        training: Whether a training comes first.
    """
    condition = str(trial["assistance"]).split("-")[0]
    texts = [*story.split("\n\n"), HELP.get(condition, ""), TRAINING if training else ""]
    shown = [text for text in texts if text.strip()]
    return page("story", "Tidy the apartment", paragraphs=shown, opened=round(1000.0 * time.time()))


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


def _escaped(value: object) -> str:
    if isinstance(value, list):
        return "\n".join(f"<p>{html.escape(text)}</p>" for text in value)
    return html.escape(str(value))


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
    return Template((resources.files(__package__) / "templates" / f"{name}.html").read_text("utf-8"))
