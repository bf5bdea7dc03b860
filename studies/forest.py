"""A forest plot that compares published effect sizes with those of another study."""

from matplotlib.figure import Figure

from experiments.analysis.page import FigureBlock
from experiments.analysis.report.figures import framed
from studies.published import Published
from studies.score import EFFECT_SIZE, Score

FOREST = (
    "Partial η² of each published test: the published one with its 90 % confidence interval (grey; an arrow where only "
    '"n.s." is printed), the effect sizes of ours that go with it (wide bar), and ours (blue where it agrees, orange '
    "where not)."
)
PUBLISHED, TARGET, AGREES, DIFFERS = "#444444", "#DDDDDD", "#0072B2", "#D55E00"


def forest(score: Score, published: Published) -> FigureBlock:
    """Draw a forest plot with a row for each effect size that was judged."""
    tests = {(t.measure, str(t.effect), t.objects): t for t in published.tests}
    rows = [r for r in score.rows if r.kind == EFFECT_SIZE and r.target is not None]
    figure = Figure(figsize=(7.5, 0.42 * max(len(rows), 1) + 1.0), layout="constrained")
    axes = figure.subplots()
    for place, row in enumerate(rows):
        people = published.people_of(row.objects)
        low, high = row.target or (0.0, 0.0)
        axes.barh(-place, high - low, left=low, height=0.7, color=TARGET)
        test = tests[row.measure, row.what, row.objects].test(people)
        if test is None:
            axes.annotate(
                "",
                (0, -place + 0.15),
                (high, -place + 0.15),
                arrowprops={"arrowstyle": "->", "color": PUBLISHED},
            )
        else:
            ends = test.interval or (test.eta_squared, test.eta_squared)
            axes.plot(ends, [-place + 0.15] * 2, color=PUBLISHED, lw=1.5)
            axes.plot(test.eta_squared, -place + 0.15, "s", color=PUBLISHED, ms=5)
        ours = float(row.ours.split()[0])
        axes.plot(ours, -place - 0.17, "o", color=AGREES if row.agrees else DIFFERS, ms=6)
    names = [f"{r.measure}: {r.what}, {r.objects or 'all'} objects" for r in rows]
    axes.set_yticks([-k for k in range(len(rows))], names, fontsize=8)
    axes.set_xlabel("partial η²", fontsize=9)
    axes.set_xlim(left=0)
    axes.spines[["top", "right"]].set_visible(False)
    return framed(figure, "Published effect sizes and ours", score.origin, FOREST)
