"""`mjsim house gallery`: pictures, sheets and pages of homes."""

import re

import cv2
import pytest

from experiments.cli.main import main
from experiments.web.viewing import gallery
from tests.example_house import write_example_house


class Here:
    """Draws in this process."""

    def __init__(self, _workers):
        pass

    def __enter__(self):
        from concurrent.futures import ThreadPoolExecutor

        self._pool = ThreadPoolExecutor(1)
        return self._pool

    def __exit__(self, *_):
        self._pool.shutdown()


@pytest.fixture
def in_this_process(monkeypatch):
    monkeypatch.setattr(gallery, "worker_pool", Here)


@pytest.mark.slow
@pytest.mark.usefixtures("in_this_process")
def test_homes_are_drawn_once_and_listed(tmp_path, capsys):
    own, out = write_example_house(tmp_path / "my house").parent, tmp_path / "gallery"
    sources = ["generated:7?rooms=1", str(own), "generated:7?rooms=1"]
    assert main(["house", "gallery", *sources, "--out", str(out)]) == 0
    assert "(2 homes)" in capsys.readouterr().out
    homes = {path.name: path.stat().st_ino for path in (out / "homes").iterdir()}
    assert set(homes) == {"generated_7_1", "my_house"}
    page = (out / "index.html").read_text("utf-8")
    files = set(re.findall(r'(?:src|href)="(homes/[^"]+)"', page))
    assert len(files) == 8  # a page, a plan and two views each
    assert all((out / file).is_file() for file in files)
    assert "seed 7, version" in page
    assert cv2.imread(str(out / "sheet_1.png")).shape[1] > 1600  # side by side
    (out / "sheet_2.png").write_bytes(b"")  # of a longer gallery
    assert main(["house", "gallery", *sources, "--out", str(out)]) == 0
    assert {path.name: path.stat().st_ino for path in (out / "homes").iterdir()} == homes
    assert not (out / "sheet_2.png").exists()
    (out / "homes" / "generated_7_1" / "home.json").write_text("{}")
    assert main(["house", "gallery", sources[0], "--out", str(out)]) == 0
    assert (out / "homes" / "generated_7_1").stat().st_ino != homes["generated_7_1"]
    assert "my_house" not in (out / "index.html").read_text("utf-8")


@pytest.mark.slow
@pytest.mark.usefixtures("in_this_process")
def test_a_home_that_cannot_be_used_leaves_the_others(tmp_path, capsys):
    bad = write_example_house(tmp_path / "bad")
    (tmp_path / "bad" / "house.xml").write_text("<mujoco/>")
    out = tmp_path / "gallery"
    assert main(["house", "gallery", str(bad), "generated:7?rooms=1", "--out", str(out)]) == 1
    said = capsys.readouterr()
    assert f"failed: {bad}: " in said.err.replace("\n", "")
    assert "(1 home, 1 failed)" in said.out


@pytest.mark.parametrize(
    ("sources", "says"),
    [
        (["nowhere"], "nowhere"),
        (["generated:5:5"], "a range's end is not included"),
        (["generated:x"], "names no house"),
    ],
)
def test_bad_sources_are_refused_first(tmp_path, capsys, sources, says):
    out = tmp_path / "gallery"
    assert main(["house", "gallery", *sources, "--out", str(out)]) == 2
    assert says in capsys.readouterr().err
    assert not out.exists()


def test_what_is_no_gallery_is_kept(tmp_path, capsys):
    (tmp_path / "mine.txt").write_text("mine")
    assert main(["house", "gallery", "apartment", "--out", str(tmp_path)]) == 2
    assert "is no gallery" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["mine.txt"]


def test_houses_of_one_name_are_refused(tmp_path, capsys):
    one, other = (str(write_example_house(tmp_path / name / "home").parent) for name in "ab")
    assert main(["house", "gallery", one, other, "--out", str(tmp_path / "gallery")]) == 2
    assert "rename one of the folders" in capsys.readouterr().err
