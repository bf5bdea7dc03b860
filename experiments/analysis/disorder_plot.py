"""Picture of the disorder in episodes of others: how many objects are out of place, how far, and which."""

from collections import Counter
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from mjsim.house.scene.disorder import Disorder
from mjsim.support.files import replacing

_KINDS = 15  # bars
_BLUE = "#0072B2"


def draw_disorder(path: Path, disorder: Disorder, kinds: Mapping[str, int]) -> None:
    """Write a PNG; `kinds` holds how many of each kind of object are out of place."""
    figure = Figure(figsize=(11, 3.4), dpi=100, layout="constrained")
    FigureCanvasAgg(figure)
    many, far, which = figure.subplots(1, 3)
    counts = Counter(disorder.misplaced)
    many.bar(list(counts), [100 * n / len(disorder.misplaced) for n in counts.values()], color=_BLUE)
    many.set(xlabel="objects out of place", ylabel="% of episodes")
    if disorder.distances:
        far.hist(disorder.distances, bins=np.arange(0, max(disorder.distances) + 0.5, 0.5), color=_BLUE)
        far.axvline(float(np.median(disorder.distances)), color="#D55E00", lw=1.5)
    far.set(xlabel="to where it belongs, m (line: median)", ylabel="objects")
    names = sorted(kinds, key=lambda kind: (-kinds[kind], kind))[:_KINDS][::-1]
    which.barh(names, [kinds[name] for name in names], color=_BLUE)
    which.tick_params(axis="y", labelsize=7)
    which.set(xlabel="times out of place")
    for axes in (many, far, which):
        axes.spines[["top", "right"]].set_visible(False)
    with replacing(path) as temporary:
        figure.savefig(temporary, format="png", metadata={"Software": "mjsim"})
