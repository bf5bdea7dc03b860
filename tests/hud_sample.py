"""A made-up tidying task with drawn pictures, to look at the HUD without a simulator."""

import tomllib
from pathlib import Path

import cv2
import numpy as np

from hud.projection import CameraView
from hud.task import KnownPlan, TaskObject, TaskReceptacle, TaskStep, TaskView
from hud.texts import HudTexts

EYE = (0.0, 0.0, 1.6)
TEXT_FILES = Path(__file__).parents[1] / "experiments/texts"
ROOMS = ("Kitchen", "Living room", "Bedroom", "Office", "Hallway")

_BINS = (
    ("dish_bin", "Dish bin", "on the counter, beside the sink", "Kitchen", (86, 180, 233)),
    ("toy_box", "Toy box", "beside the sofa", "Living room", (230, 159, 0)),
    ("bookshelf", "Bookshelf", "opposite the window", "Living room", (150, 90, 50)),
    ("hamper", "Laundry hamper", "at the foot of the bed", "Bedroom", (204, 121, 167)),
    ("office_box", "Office-supply box", "on the desk", "Office", (0, 114, 178)),
    ("recycling_bin", "Recycling bin", "beside the front door", "Hallway", (0, 158, 115)),
)
_LABELS = (
    ("Blue mug", "Soup bowl", "Dinner plate", "Drinking glass"),
    ("Toy car", "Teddy bear", "Building blocks", "Rubber duck"),
    ("Novel", "Travel magazine", "Dictionary", "Comic book"),
    ("T-shirt", "Bath towel", "Pair of socks", "Jeans"),
    ("Stapler", "Tape dispenser", "Calculator", "Pencil case"),
    ("Cardboard box", "Plastic bottle", "Drink can", "Newspaper"),
)


def texts(language="en"):
    return HudTexts(**tomllib.loads((TEXT_FILES / f"{language}.toml").read_text("utf-8"))["hud"])


TEXTS = texts()


def receptacles():
    """Six bins, one per category."""
    return tuple(
        TaskReceptacle(key, label, place, room, f"receptacle:{key}", (1.5 * i - 3.0, 6.0, 0.4))
        for i, (key, label, place, room, _) in enumerate(_BINS)
    )


def objects(count):
    """The first `count` of 24 objects, all lying about, in equal numbers per category."""
    labels = [(kind, _LABELS[kind][i]) for i in range(4) for kind in range(6)]
    return tuple(
        TaskObject(
            name=f"object_{i:02d}",
            label=label,
            picture=f"object:{label}",
            category=_BINS[kind][0],
            room=ROOMS[(3 * i + 1) % len(ROOMS)],
            position=(float((i * 5) % 7) - 3.0, 2.0 + float((i * 3) % 5), 0.02),
            status="loose",
            receptacle=_BINS[kind][0],
        )
        for i, (kind, label) in enumerate(labels[:count])
    )


def task(count, *, steps=0, message=None, clock=83.0):
    """A task of `count` objects, `steps` visits into a plan that fetches two objects at a time."""
    items = objects(count)
    plan = []
    for i in range(0, count, 2):
        pair = [o.name for o in items[i : i + 2]]
        plan += [TaskStep("pick", n) for n in pair] + [TaskStep("place", n) for n in pair]
    done, left = plan[:steps], tuple(plan[steps:])
    items = tuple(_with_status(o, done) for o in items)
    carried = [o.name for o in items if o.status == "carried"]
    goal = None
    if left:
        ahead = next(o for o in items if o.name == left[0].object)
        bins = {r.key: r for r in receptacles()}
        goal = ahead.position if left[0].kind == "pick" else bins[ahead.receptacle].position
    way = None if goal is None else np.array([[0.0, 0.0], [0.3, 1.4], [goal[0], goal[1]]])
    return TaskView(
        objects=items,
        receptacles=receptacles(),
        order=tuple(o.name for o in sorted(items, key=lambda o: (int(o.name[-2:]) * 7) % 25)),
        texts=TEXTS,
        hands=(carried[0] if carried else None, carried[1] if len(carried) > 1 else None),
        steps_done=tuple(done),
        ahead=KnownPlan(left, segment=way, path=way, goal=goal),
        eye=EYE,
        message=message,
        clock=clock,
    )


def camera(width, height, *, yaw=0.0, pitch=-0.35):
    """An eye at the origin that looks along +y, turned by `yaw` to the left and `pitch` upwards, rad."""
    cy, sy, cp, sp = np.cos(yaw), np.sin(yaw), np.cos(pitch), np.sin(pitch)
    right = np.array([cy, sy, 0.0])
    forward = np.array([-sy * cp, cy * cp, sp])
    rotation = np.stack([right, np.cross(right, forward), -forward], axis=1)
    return CameraView(np.array(EYE), rotation, 1.2, width, height)


def pictures(size=96):
    """A simple picture per object and per bin: RGBA, uint8, shape (size, size, 4)."""
    drawn = {}
    for kind, (key, _, _, _, colour) in enumerate(_BINS):
        drawn[f"receptacle:{key}"] = _box(colour, size)
        for i, label in enumerate(_LABELS[kind]):
            drawn[f"object:{label}"] = _token(colour, 3 + i, size)
    return drawn


def backdrop(width, height):
    """A plain room: wall, floor and a dark doorway, uint8, shape (height, width, 3)."""
    rows = np.linspace(0.0, 1.0, height)[:, None, None]
    wall = np.array([226.0, 219.0, 206.0]) - 40.0 * rows
    floor = np.array([188.0, 148.0, 108.0]) - 60.0 * (rows - 0.45)
    image = np.where(rows < 0.45, wall, floor) * np.ones((1, width, 1))
    door = np.s_[int(0.1 * height) : int(0.5 * height), int(0.46 * width) : int(0.6 * width)]
    image[door] *= 0.35
    return np.asarray(np.clip(np.rint(image), 0, 255), dtype=np.uint8)


def _with_status(item, done):
    status = "loose"
    if TaskStep("place", item.name) in done:
        status = "delivered"
    elif TaskStep("pick", item.name) in done:
        status = "carried"
    return TaskObject(**{**vars(item), "status": status})


def _box(colour, size):
    """An open crate."""
    image = np.zeros((size, size, 4), dtype=np.uint8)
    points = np.array([[0.12, 0.35], [0.88, 0.35], [0.78, 0.88], [0.22, 0.88]]) * size
    dark = (int(0.6 * colour[0]), int(0.6 * colour[1]), int(0.6 * colour[2]), 255)
    cv2.fillPoly(image, [np.rint(points).astype(np.int32)], (*colour, 255), cv2.LINE_AA)
    cv2.ellipse(
        image, (size // 2, int(0.35 * size)), (int(0.38 * size), int(0.1 * size)), 0, 0, 360, dark, -1
    )
    return image


def _token(colour, corners, size):
    """A regular polygon."""
    image = np.zeros((size, size, 4), dtype=np.uint8)
    angles = np.arange(corners) * 2.0 * np.pi / corners - np.pi / 2.0
    points = size * (0.5 + 0.4 * np.stack([np.cos(angles), np.sin(angles)], axis=1))
    cv2.fillPoly(image, [np.rint(points).astype(np.int32)], (*colour, 255), cv2.LINE_AA)
    return image
