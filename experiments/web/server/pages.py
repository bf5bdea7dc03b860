"""Rendering of the client's Jinja2 templates."""

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
    """Return the paths of a page's modules, which the browser can preload in parallel."""
    return tuple(modules_of(entry))


_templates = Jinja2Templates(CLIENT / "templates")
_templates.env.filters.update(duration=_duration, filled=filled)
_templates.env.globals.update(modules=_modules, static=static_url)
_templates.env.trim_blocks = True
_templates.env.auto_reload = False  # would check the file for each page


def page(request: Request, name: str, status: int = 200, **values: Any) -> Response:
    """Render the template with this name."""
    return _templates.TemplateResponse(request, f"{name}.html", values, status)


def message_page(request: Request, status: int, title: str, text: str) -> Response:
    return page(request, "message", status, title=title, text=text)


def trial_texts(sections: Mapping[str, Mapping[str, Any]]) -> dict[str, str]:
    """Return the texts of the trial page by name, from a language's texts by section."""
    return {name: text for section in ("common", "hud", "trial") for name, text in sections[section].items()}
