"""Hooks of mkdocs.yml: links that are right on GitHub are right in the site."""

import re
from typing import Any


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Keep the text of links that lead out of docs/."""
    return re.sub(r"\[([^\]]*)\]\(\.\./[^)]*\)", r"\1", markdown)


def on_page_content(html: str, page: Any, **_: Any) -> str:
    """Let the links of a notebook lead to pages; MkDocs does that for Markdown alone."""
    if not page.file.src_uri.endswith(".ipynb"):
        return html
    return re.sub(r'href="([\w-]+)\.md"', r'href="../\1/"', html)
