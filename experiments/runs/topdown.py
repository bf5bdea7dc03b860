"""Floor plan of a trial: rooms, objects, receptacles, the planned and the walked path."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray

from experiments.house import House
from experiments.runs.records import Event
from mjsim.episode import Episode
from mjsim.files import replacing
from mjsim.model.scene import Scene
from mjsim.render import largest_scale, render_floorplan
from mjsim.world import World

# Okabe-Ito colours, distinct for all common kinds of colour vision.
CATEGORY_COLOURS = ("#E69F00", "#56B4E9", "#009E73", "#F0E442", "#0072B2", "#CC79A7")
PLANNED, WALKED = "#D55E00", "#1B1B1B"
PIXELS_PER_METRE = 80  # of a house of usual size
LARGEST_SIDE = 1920  # of the picture of the house, px; larger houses are drawn at a smaller scale
LEGEND = 7.0  # inches that the legend needs


def draw_topdown(
    path: Path, house: House, scene: Scene, plan: Event, arrays: Mapping[str, NDArray[Any]], origin: str
) -> None:
    """Write a PNG of the house with the plan at the start and the path walked.

    Args:
        path: PNG file to write.
        house: The house.
        scene: The composed episode.
        plan: The first `plan` event of the log.
        arrays: The trajectory, as `Trajectory.arrays` gives it; only `position` is drawn, m, shape (T, 2).
        origin: Whether the participant is simulated (`experiments.origin`).
    """
    scale = _scale(house.bounds)
    scene = scene.counterpart(visuals=True)
    floor = render_floorplan(scene.model, World(scene).data, house.bounds, pixels_per_metre=scale)
    x_min, y_min, x_max, y_max = floor.bounds
    inches = 0.95 * scale / PIXELS_PER_METRE  # per metre
    size = max((x_max - x_min) * inches, LEGEND), (y_max - y_min) * inches + 0.9
    figure = Figure(figsize=size, dpi=100, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    axes.imshow(floor.rgb, extent=(x_min, x_max, y_min, y_max), interpolation="bilinear")
    _draw_rooms(axes, house)
    planned = planned_path(house, scene.episode, plan)
    _draw_line(axes, planned, PLANNED, "--", f"planned at the start, {_length(planned):.1f} m")
    walked = arrays["position"]
    _draw_line(axes, walked, WALKED, "-", f"walked, {_length(walked):.1f} m")
    axes.plot(
        *walked[0], marker="*", markersize=17, color="white", markeredgecolor="black", ls="", label="start"
    )
    _draw_objects(axes, house, scene)
    axes.set(xlim=(x_min, x_max), ylim=(y_min, y_max), aspect="equal", xticks=[], yticks=[])
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.01), ncols=5, frameon=False, fontsize=10)
    mark_origin(figure, origin)
    with replacing(path) as temporary:
        # Fixed metadata, so that equal trials give equal bytes.
        figure.savefig(temporary, metadata={"Software": "mjsim"})


def mark_origin(figure: Figure, origin: str) -> None:
    """Say above a figure whether people were simulated."""
    figure.suptitle(origin, fontsize=8, x=0.99, ha="right", color="#B00020")


def _scale(bounds: tuple[float, float, float, float]) -> float:
    """Pixels per metre."""
    x_min, y_min, x_max, y_max = bounds
    return min(PIXELS_PER_METRE, LARGEST_SIDE / max(x_max - x_min, y_max - y_min), largest_scale(bounds))


def planned_path(house: House, episode: Episode, plan: Event) -> NDArray[np.float64]:
    """Floor points of the tour of a `plan` event, m, shape (k, 2)."""
    places = {o.name: np.array(o.position[:2]) for o in episode.objects}
    here = house.navmesh.snap(np.array([episode.start.x, episode.start.y]))
    points = [here[None]]
    for kind, name in plan["visits"]:
        target = places[name] if kind == "pick" else house.receptacles[episode.targets[name]].approach
        there = house.navmesh.snap(target)
        points.append(house.geodesics.shortest_path(here, there).points)
        here = there
    return np.vstack(points)


def _draw_rooms(axes: Axes, house: House) -> None:
    for key, label in house.rooms.labels.items():
        centre = house.rooms.centers[house.rooms.keys.index(key)]
        axes.annotate(
            label,
            centre,
            ha="center",
            va="center",
            fontsize=12,
            color="#333333",
            weight="bold",
            path_effects=[withStroke(linewidth=3, foreground="white")],
        )


def _draw_line(axes: Axes, points: NDArray[np.float64], colour: str, style: str, label: str) -> None:
    halo = [withStroke(linewidth=4.5, foreground="white")]
    axes.plot(points[:, 0], points[:, 1], color=colour, ls=style, lw=2.2, label=label, path_effects=halo)


def _draw_objects(axes: Axes, house: House, scene: Scene) -> None:
    episode = scene.episode
    for colour, category in zip(CATEGORY_COLOURS, house.catalogue.categories.values(), strict=False):
        places = np.array([o.position[:2] for o in episode.objects if o.category == category.key])
        bin_place = house.receptacles[category.receptacle].center[:2]
        if len(places):
            axes.plot(
                *places.T,
                marker="o",
                markersize=11,
                color=colour,
                markeredgecolor="black",
                ls="",
                label=category.label,
            )
        axes.plot(*bin_place, marker="s", markersize=13, color=colour, markeredgecolor="black", ls="")


def _length(points: NDArray[np.float64]) -> float:
    return float(np.linalg.norm(np.diff(points, axis=0), axis=1).sum())
