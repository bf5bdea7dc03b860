from pathlib import Path

import pytest

from mjsim.support.files import write_folder


def test_a_folder_that_another_process_has_written_is_kept(tmp_path: Path) -> None:
    home = tmp_path / "homes" / "7"
    write_folder(home, {"house.xml": b"first", "textures/rug.png": b"rug"})
    write_folder(home, {"house.xml": b"second"})
    assert (home / "house.xml").read_bytes() == b"first"
    assert (home / "textures" / "rug.png").read_bytes() == b"rug"
    assert list(home.parent.iterdir()) == [home]


def test_a_folder_that_lacks_a_file_is_not_kept(tmp_path: Path) -> None:
    write_folder(tmp_path / "7", {"house.xml": b"house"})
    with pytest.raises(OSError, match="not empty"):
        write_folder(tmp_path / "7", {"house.xml": b"house", "catalogue.toml": b"catalogue"})
