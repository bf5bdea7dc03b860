"""Export a floor plan with doors and windows, but without furniture, as a ProcTHOR house.

Walls in ProcTHOR have no thickness and are the centre lines of walls in mjsim. Doors and windows are replaced
by the ProcTHOR assets with the closest size.
"""

from collections.abc import Iterator
from typing import Any

from mjsim.formats.procthor.plan import NAMES
from mjsim.generator.openings import wall_stretches
from mjsim.generator.values import CEILING_HEIGHT, SIDES, WALL, Door, HomePlan, Room, Side, Window, opposite

_TYPES = {"kitchen": "Kitchen", "bathroom": "Bathroom", "shower_room": "Bathroom", "bedroom": "Bedroom"}
# ProcTHOR assets for doors and for passages. Doors wider than _WIDE metres become passages.
_DOOR, _PASSAGE, _WIDE = "Doorway_2", "Doorframe_Double_2", 1.2
_WINDOWS = {  # ProcTHOR's window assets by width in metres
    0.92: "Window_Fixed_36x48",
    1.22: "Window_Slider_48x48",
    1.53: "Window_Slider_60x48",
    2.44: "Window_Fixed_96x48",
}


def procthor_house(plan: HomePlan) -> dict[str, Any]:
    """Convert a floor plan to a ProcTHOR house that can be serialized as JSON."""
    ids = {room.key: f"room|{number}" for number, room in enumerate(plan.rooms, 2)}
    walls = [wall for room in plan.rooms for wall in _walls(plan, room, ids)]
    return {
        "rooms": [_room(room, ids[room.key]) for room in plan.rooms],
        "walls": walls,
        "doors": [_door(plan, door, ids, number) for number, door in enumerate(plan.doors)],
        "windows": [_window(plan, window, ids, number) for number, window in enumerate(plan.windows)],
        "objects": [],
        "proceduralParameters": {
            "ceilingMaterial": {"name": "PureWhite"},
            "floorColliderThickness": 1.0,
            "lights": [],
            "receptacleHeight": 0.7,
            "reflections": [],
            "skyboxId": "SkyMountain",
        },
        "metadata": {
            "schema": "1.0.0",
            NAMES: {ids[room.key]: [room.key, room.label] for room in plan.rooms},
        },
    }


def _room(room: Room, name: str) -> dict[str, Any]:
    cell = room.floor.grown(WALL / 2)
    corners = ((cell.x0, cell.y0), (cell.x0, cell.y1), (cell.x1, cell.y1), (cell.x1, cell.y0))
    return {
        "id": name,
        "roomType": _TYPES.get(room.use, "LivingRoom"),
        "floorMaterial": {"name": "WoodFloorsCross"},
        "floorPolygon": [_point(x, 0.0, y) for x, y in corners],
        "ceilings": [],
        "children": [],
    }


def _walls(plan: HomePlan, room: Room, ids: dict[str, str]) -> Iterator[dict[str, Any]]:
    for side in SIDES:
        for start, end, is_outside in wall_stretches(room, side, plan.rooms):
            name = _wall_name(ids[room.key], room, side, start, end)
            ends = [_on(room, side, at) for at in _ordered(side, start, end)]
            polygon = [_point(x, z, y) for z in (0.0, CEILING_HEIGHT) for x, y in ends]
            material = {"name": "Walldrywall4Tiled"}
            yield {"id": name, "roomId": ids[room.key], "polygon": polygon, "material": material}
            if is_outside:
                outer = "wall|exterior|" + name.split("|", 2)[2]
                yield {"id": outer, "roomId": "exterior", "polygon": polygon[::-1], "material": material}


def _ordered(side: Side, start: float, end: float) -> tuple[float, float]:
    return (start, end) if side in ("west", "north") else (end, start)


def _on(room: Room, side: Side, at: float) -> tuple[float, float]:
    x, y = room.floor.along(side, at, at, -WALL / 2, -WALL / 2).center
    return round(x, 4), round(y, 4)


def _wall_name(room: str, at: Room, side: Side, start: float, end: float) -> str:
    (x0, y0), (x1, y1) = _on(at, side, start), _on(at, side, end)
    return f"wall|{room.split('|')[1]}|{x0:.2f}|{y0:.2f}|{x1:.2f}|{y1:.2f}"


def _hole(
    plan: HomePlan, room: str, side: Side, opening: Door | Window, ids: dict[str, str]
) -> tuple[str, dict[str, Any]]:
    of = plan.room(room)
    start, end, _ = min(
        wall_stretches(of, side, plan.rooms),
        key=lambda one: max(one[0] - opening.center, opening.center - one[1]),
    )
    middle = abs(opening.center - _ordered(side, start, end)[0])
    bottom, top = (opening.sill, opening.top) if isinstance(opening, Window) else (0.0, opening.height)
    corners = [
        _point(middle - opening.width / 2, bottom, 0.0),
        _point(middle + opening.width / 2, top, 0.0),
    ]
    name = _wall_name(ids[room], of, side, start, end)
    return name, {"holePolygon": corners, "assetPosition": _point(middle, (bottom + top) / 2, 0.0)}


def _door(plan: HomePlan, door: Door, ids: dict[str, str], number: int) -> dict[str, Any]:
    first, last = door.rooms[0], door.rooms[-1]
    wall0, hole = _hole(plan, first, door.side, door, ids)
    wall1 = "wall|exterior|" + wall0.split("|", 2)[2]
    if not door.is_front:
        wall1, _ = _hole(plan, last, opposite(door.side), door, ids)
    return {
        "id": f"door|{number}",
        "assetId": _PASSAGE if door.width > _WIDE else _DOOR,
        "openable": not door.is_front,
        "openness": int(not door.is_front),
        "room0": ids[first],
        "room1": ids[last],
        "wall0": wall0,
        "wall1": wall1,
        **hole,
    }


def _window(plan: HomePlan, window: Window, ids: dict[str, str], number: int) -> dict[str, Any]:
    wall, hole = _hole(plan, window.room, window.side, window, ids)
    return {
        "id": f"window|{number}",
        "assetId": _WINDOWS[min(_WINDOWS, key=lambda width: abs(width - window.width))],
        "room0": ids[window.room],
        "room1": ids[window.room],
        "wall0": wall,
        "wall1": "wall|exterior|" + wall.split("|", 2)[2],
        **hole,
    }


def _point(x: float, y: float, z: float) -> dict[str, float]:
    return {"x": round(x, 4), "y": round(y, 4), "z": round(z, 4)}
