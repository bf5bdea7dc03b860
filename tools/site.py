"""Hook of mkdocs.yml: pages name files of the checkout, where GitHub has links to them."""

import re
from typing import Any


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Keep the text of links that lead out of docs/."""
    return re.sub(r"\[([^\]]*)\]\(\.\./[^)]*\)", r"\1", markdown)
