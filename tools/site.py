"""Hooks for MkDocs: add a demo to the front page, and adapt links that also have to work on GitHub."""

import re
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File

RUN = ["run", "--assistance", "guided", "--fidelity", "event", "--no-video", "--no-floor-plan"]
PAGE = "demo.html"  # page with the demo, which docs/index.md embeds


def on_files(files: Any, config: Any, **_: Any) -> Any:
    """Add the demo page, unless the execution of notebooks is disabled."""
    if not config.plugins["mkdocs-jupyter"].config["execute"]:
        return files
    with tempfile.TemporaryDirectory() as folder:
        run, page = f"{folder}/run", Path(folder, PAGE)
        for words in ([*RUN, "--out", run], ["view", run, "--out", str(page)]):
            done = subprocess.run([sys.executable, "-m", "mjsim", *words], capture_output=True, text=True)
            if done.returncode:
                raise RuntimeError(f"mjsim {words[0]} failed, so the front page has no run: {done.stderr}")
        files.append(File.generated(config, PAGE, content=page.read_bytes()))
    return files


def on_page_markdown(markdown: str, **_: Any) -> str:
    """Replace links to files outside docs/ by their text."""
    return re.sub(r"\[([^\]]*)\]\(\.\./[^)]*\)", r"\1", markdown)


def on_page_content(html: str, page: Any, **_: Any) -> str:
    """Convert a notebook's links to Markdown files into links to pages, which MkDocs does not do itself."""
    if not page.file.src_uri.endswith(".ipynb"):
        return html
    return re.sub(r'href="([\w-]+)\.md(#[^"]*)?"', r'href="../\1/\2"', html)
