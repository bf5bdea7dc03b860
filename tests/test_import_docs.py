"""The worked example of docs/import.md runs as it stands, and says what it prints."""

import json
import re
import shlex
import sys
from pathlib import Path

import pytest

from experiments import cli
from mjsim.model.catalogue import Catalogue

PAGE = (Path(__file__).resolve().parents[1] / "docs" / "import.md").read_text(encoding="utf-8")


def blocks(language: str) -> list[str]:
    return re.findall(rf"```{language}\n(.*?)```", PAGE, flags=re.DOTALL)


def test_the_example_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "path", [*sys.path])
    for code in blocks("python"):
        exec(compile(code, "docs/import.md", "exec"), {})
    for line in blocks("sh")[0].splitlines():
        words = [*shlex.split(line)[1:], *(["--fidelity", "event"] if " run " in line else [])]
        assert cli.main(words) == 0
    assert "toy_robot" in Catalogue.load("my-house/catalogue.toml").categories["toys"].objects
    assert "toy_robot" in Path("runs/robot/episode.json").read_text(encoding="utf-8")
    for row in json.loads(Path("my-house/toy_robot/report.json").read_text(encoding="utf-8")):
        cells = " | ".join((row["what"], row["choice"], row["reason"])).strip()
        assert f"| {cells} |" in PAGE
