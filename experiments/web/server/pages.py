"""The pages, from the Jinja2 templates of the client."""

from pathlib import Path
from typing import Any

from starlette.requests import Request
from starlette.responses import Response
from starlette.templating import Jinja2Templates

CLIENT = Path(__file__).parents[1] / "client"
STATIC = CLIENT / "static"


def _duration(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes} min {rest} s" if minutes else f"{rest} s"


_templates = Jinja2Templates(CLIENT / "templates")
_templates.env.filters["duration"] = _duration
_templates.env.trim_blocks = True


def page(request: Request, name: str, status: int = 200, **values: Any) -> Response:
    """A page from the template with a name; its values are escaped."""
    return _templates.TemplateResponse(request, f"{name}.html", values, status)


def message_page(request: Request, status: int, title: str, text: str) -> Response:
    """A page with a title and a sentence."""
    return page(request, "message", status, title=title, text=text)
