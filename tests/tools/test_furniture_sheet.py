from tools.furniture_sheet import CELL, pictures


def test_a_kind_has_three_pictures_that_differ() -> None:
    cells = list(pictures("stool"))
    assert [cell.shape for cell in cells] == [(CELL[1], CELL[0], 3)] * 3
    assert len({cell.tobytes() for cell in cells}) == 3
