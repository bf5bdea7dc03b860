"""Forms that browsers send."""

from urllib.parse import parse_qsl

from starlette.datastructures import ImmutableMultiDict
from starlette.requests import Request

MAX_FIELDS = 500


async def sent_form(request: Request) -> ImmutableMultiDict[str, str]:
    """The fields of a form that was sent; none where that is no form, or has too many."""
    text = (await request.body()).decode("utf-8", "replace")
    try:
        return ImmutableMultiDict(parse_qsl(text, keep_blank_values=True, max_num_fields=MAX_FIELDS))
    except ValueError:
        return ImmutableMultiDict()
