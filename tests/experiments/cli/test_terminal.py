"""Progress is shown as bars on a terminal, and as lines elsewhere."""

import io

from rich.console import Console
from rich.progress import Progress

from experiments.cli.flythrough import film_house
from experiments.cli.progress_lines import INTERVAL_S, ProgressLines
from experiments.cli.terminal import progress_bars


def lines_of(steps):
    """Lines that are printed if each step takes half of the interval."""
    now, text = [0.0], io.StringIO()
    with ProgressLines(console=Console(file=text), get_time=lambda: now[0]) as bars:
        bar = bars.add_task("frames [1]", total=None)
        for done in range(1, steps + 1):
            now[0] += INTERVAL_S / 2
            bars.update(bar, completed=done, total=8)
    return text.getvalue().splitlines()


def test_a_line_is_printed_when_the_last_one_is_old():
    assert lines_of(1) == []
    assert lines_of(5) == ["frames [1]: 2 of 8 after 5 s", "frames [1]: 4 of 8 after 10 s"]


def test_tracked_and_advanced_tasks_print_lines():
    now, text = [0.0], io.StringIO()
    with ProgressLines(console=Console(file=text), get_time=lambda: now[0]) as bars:
        bar = bars.add_task("homes", total=2)
        now[0] = INTERVAL_S
        bars.advance(bar)
    assert text.getvalue() == "homes: 1 of 2 after 5 s\n"


def test_only_terminals_get_bars():
    assert isinstance(progress_bars(Console(file=io.StringIO())), ProgressLines)
    bars = progress_bars(Console(file=io.StringIO(), force_terminal=True))
    assert type(bars) is Progress and not bars.disable


def test_a_terminal_shows_that_the_house_of_a_film_is_loading(monkeypatch, capsys, tmp_path):
    monkeypatch.setenv("FORCE_COLOR", "1")  # a terminal, to rich
    shown = []

    class Loaded:
        texts = None

        def in_language(self, *_):
            return self

    def load(_name):
        shown.append(capsys.readouterr().err)
        return Loaded()

    def write(*_, on_progress, **__):
        on_progress(3, 7)
        return "digest"

    monkeypatch.setattr("experiments.house.House.load", load)
    monkeypatch.setattr("experiments.session.film.write_flythrough", write)
    assert film_house("apartment", tmp_path / "film.mp4") == "digest"
    last = capsys.readouterr().err
    assert "loading the house" in shown[0]
    assert "frames of the film" in last and "3/7" in last
