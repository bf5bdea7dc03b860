"""Pictures of a tidy house: names on the floor plan, and views of rooms."""

import numpy as np
import pytest

from experiments.session import house_pictures
from experiments.session.house_pictures import _corner_views, floor_plan


def test_each_name_on_the_floor_plan_is_in_the_middle_of_its_room(house, monkeypatch):
    written = []
    monkeypatch.setattr(
        house_pictures, "_write_over", lambda _, lines, x, y: written.append((lines[0], x, y))
    )
    bare = floor_plan(house)
    monkeypatch.undo()
    drawn, rooms = (floor_plan(house) != bare).any(axis=2), house.rooms
    first, *_ = (rooms.centers[rooms.keys.index(key)] for key in rooms.labels)
    scale = bare.shape[1] / (house.bounds[2] - house.bounds[0] + 2 * house_pictures.MARGIN)
    for (name, x, y), (key, label) in zip(written, rooms.labels.items(), strict=True):
        number = rooms.keys.index(key)
        assert label.startswith(name)
        offset = (rooms.centers[number] - first) * (scale, -scale)
        assert (x - written[0][1], y - written[0][2]) == pytest.approx(offset, abs=1.5)
        width, height = (scale * rooms.half_sizes[number]).astype(int)
        rows, columns = np.nonzero(drawn[y - height : y + height, x - width : x + width])
        assert np.ptp(columns) > 20
        assert [np.mean(columns) - width, np.mean(rows) - height] == pytest.approx([0, 0], abs=6)
        drawn[y - height : y + height, x - width : x + width] = False
    assert not drawn.any(), "nothing is written outside the rooms"


def test_a_view_from_the_middle_of_a_small_room_does_not_look_at_the_feet(house):
    for room, points in house.viewpoints.items():
        for view in _corner_views(house, room, np.zeros((0, 2)), np.array(points[0])):
            assert -view.rotation[2, 2] > -0.9, room
