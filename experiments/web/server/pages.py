"""The pages, from the Jinja2 templates of the client."""

import functools
from collections.abc import Mapping
from typing import Any

from starlette.requests import Request
from starlette.responses import Response
from starlette.templating import Jinja2Templates

from experiments.web.client_files import STATIC, modules_of, static_url
from hud.texts import filled

CLIENT = STATIC.parent


def _duration(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes} min {rest} s" if minutes else f"{rest} s"


@functools.cache
def _modules(entry: str) -> tuple[str, ...]:
    """Paths of all modules of a page, which a browser then loads at once rather than one import after the other."""
    return tuple(modules_of(entry))


_templates = Jinja2Templates(CLIENT / "templates")
_templates.env.filters.update(duration=_duration, filled=filled)
_templates.env.globals.update(modules=_modules, static=static_url)
_templates.env.trim_blocks = True
_templates.env.auto_reload = False  # would look at the file for each page


def page(request: Request, name: str, status: int = 200, **values: Any) -> Response:
    """A page from the template with a name; its values are escaped."""
    return _templates.TemplateResponse(request, f"{name}.html", values, status)


def message_page(request: Request, status: int, title: str, text: str) -> Response:
    """A page with a title and a sentence."""
    return page(request, "message", status, title=title, text=text)


def trial_texts(sections: Mapping[str, Mapping[str, Any]]) -> dict[str, str]:
    """Texts of the page of a trial, by name, from those of a language by section."""
    return {name: text for section in ("common", "hud", "trial") for name, text in sections[section].items()}
