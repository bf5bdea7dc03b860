"""The report of the planner benchmark as a table, lines of text and a figure."""

import io
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from benchmarks.support.planner_cases import COUNTS


def summary(records: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return a table row for each planner, problem size and kind, including the optimality gaps."""
    best: dict[tuple[int, int, str], float] = {}
    groups: dict[tuple[int, str, str], list[dict[str, Any]]] = {}
    for r in records:
        if r["cost"] is not None:
            key = r["objects"], r["seed"], r["kind"]
            best[key] = min(best.get(key, r["cost"]), r["cost"])
        groups.setdefault((r["objects"], r["kind"], r["planner"]), []).append(r)
    ranked = sorted(groups.items(), key=lambda item: (item[0][0], list(COUNTS).index(item[0][1])))
    return [
        {"objects": n, "kind": kind, "planner": planner, **figures(group, best)}
        for (n, kind, planner), group in ranked
    ]


def figures(group: Sequence[dict[str, Any]], best: dict[tuple[int, int, str], float]) -> dict[str, Any]:
    """Summarize the results of one planner for one problem size and kind. Missing values are None."""
    solved = [r for r in group if r["cost"] is not None]
    gaps = [100 * (r["cost"] / best[r["objects"], r["seed"], r["kind"]] - 1) for r in solved]
    # The gap of a tour of length 0 is 0.
    bounds = [100 * (r["cost"] - r["bound"]) / (r["cost"] or 1.0) for r in solved if r["bound"] is not None]
    cpu, wall = [r["cpu"] for r in group], [r["wall"] for r in group]
    return {
        "problems": len(group),
        "solved": len(solved),
        "proven": sum(r["proven"] for r in group),
        "best": sum(gap < 0.001 for gap in gaps),
        "gap_mean": float(np.mean(gaps)) if gaps else None,
        "gap_max": max(gaps, default=None),
        "bound_gap_max": max(bounds, default=None),
        "cpu_median": float(np.median(cpu)),
        "cpu_p95": float(np.percentile(cpu, 95)),
        "cpu_max": max(cpu),
        "wall_median": float(np.median(wall)),
        "wall_p95": float(np.percentile(wall, 95)),
        "peak_mb": max(r["peak_mb"] for r in group),
    }


def lines(result: dict[str, Any]) -> Iterator[str]:
    if "summary" in result:
        yield from _table_lines(result)
        for label in result["not_installed"]:
            yield f"{label}: not installed (pip install 'mjsim[peers]')"
        yield (
            "gap: to the best tour found; best: how often it was; unproven: greatest gap to the planner's own bound; "
            "MB: most that its process had had by then"
        )
    for objects, row in result.get("limits", {}).items():
        yield (
            f"limits of 10 ms to 2 s, {objects} objects: {row['solves']} solves; late by "
            f"{1000 * row['late_median']:.0f} ms (median), {1000 * row['late_p99']:.0f} ms (99 %), "
            f"{1000 * row['late_max']:.0f} ms (most)"
        )
    if "live" in result:
        yield from _live_lines(result["live"])
    for objects, first in result.get("first_call", {}).items():
        yield (
            f"first answer in a fresh process, {objects} objects: {first['wall']:.2f} s, CPU {first['cpu']:.2f} s"
        )


def _table_lines(result: dict[str, Any]) -> Iterator[str]:
    table = Table(title=f"up to {result['houses']} problems of each kind and size; gaps in %, times in s")
    for heading in ("n", "kind", "planner"):
        table.add_column(heading, no_wrap=True)
    for heading in (
        "problems",
        "proven",
        "best",
        "gap",
        "max gap",
        "unproven",
        "CPU median",
        "p95",
        "max",
        "wall",
        "p95",
        "MB",
    ):
        table.add_column(heading, justify="right")
    previous = None
    for row in result["summary"]:
        group = row["objects"], row["kind"]
        if previous not in (None, group):
            table.add_section()
        first = ("", "") if group == previous else (str(row["objects"]), row["kind"])
        previous = group
        table.add_row(*first, row["planner"], *cells(row))
    text = io.StringIO()
    Console(file=text, width=140).print(table)
    yield from text.getvalue().splitlines()


def _live_lines(beside: dict[str, Any]) -> Iterator[str]:
    yield f"live, {beside['objects']} objects, {beside['houses']} houses, every visit drawn at random:"
    for name, row in beside["groups"].items():
        yield (
            f"  {name}: {row['replans']} replans; first plan {1000 * row['wall_median']:.0f} ms, "
            f"95 % within {1000 * row['wall_p95']:.0f} ms (CPU {1000 * row['cpu_median']:.0f}, "
            f"{1000 * row['cpu_p95']:.0f} ms), gap {row['gap_mean']:.2f} %, at most {row['gap_max']:.1f} %; "
            f"{row['proven']} proven, after {row['proof_wall_median']:.2f} s, 95 % within {row['proof_wall_p95']:.2f} s"
        )


def cells(row: dict[str, Any]) -> list[str]:
    failed = row["problems"] - row["solved"]
    counts = [
        f"{row['problems']}" + (f", {failed} failed" if failed else ""),
        str(row["proven"]),
        str(row["best"]),
    ]
    gaps = [
        "none" if row[name] is None else f"{row[name]:.2f}"
        for name in ("gap_mean", "gap_max", "bound_gap_max")
    ]
    names = ("cpu_median", "cpu_p95", "cpu_max", "wall_median", "wall_p95")
    return counts + gaps + [f"{row[name]:.2f}" for name in names] + [f"{row['peak_mb']:.0f}"]


METHODS = ("search", "cuts")  # of `exact`, so their points would lie on top of its point


def picture(result: dict[str, Any], path: Path) -> None:
    """Draw the mean gap over CPU time at 24 objects or fewer, and the CPU time of proofs by problem size."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(10, 4), layout="constrained")
    left, right = figure.subplots(1, 2)
    draw_gaps(left, [row for row in result["summary"] if not row["planner"].startswith(METHODS)])
    draw_proofs(right, [r for r in result["runs"] if r["planner"] == "exact"])
    for axes in (left, right):
        axes.grid(alpha=0.3)
    figure.savefig(path, dpi=110)


def draw_gaps(axes: Any, rows: Sequence[dict[str, Any]]) -> None:
    """Draw a labelled point per planner, with the exact planner's label below its point to avoid overlaps."""
    shown = max(row["objects"] for row in rows if row["objects"] <= 24)
    for row in rows:
        if row["objects"] != shown or row["kind"] != "apartment" or row["gap_mean"] is None:
            continue
        few = "" if row["solved"] == row["problems"] else f"\n({row['solved']} of {row['problems']} solved)"
        below = row["planner"] == "exact"
        axes.plot(row["cpu_median"], row["gap_mean"], "o")
        axes.annotate(
            row["planner"] + few,
            (row["cpu_median"], row["gap_mean"]),
            xytext=(0, -8) if below else (6, 5),
            textcoords="offset points",
            ha="center" if below else "left",
            va="top" if below else "bottom",
        )
    axes.set(
        xscale="log",
        xlabel="CPU time, s (median)",
        ylabel="mean gap, %",
        title=f"{shown} objects in the apartment",
    )
    axes.margins(x=0.4, y=0.2)


def draw_proofs(axes: Any, runs: Sequence[dict[str, Any]]) -> None:
    """Draw a point per problem, in one colour per kind, and a cross for a tour that is not proven."""
    kinds = list(dict.fromkeys(r["kind"] for r in runs))
    for k, kind in enumerate(kinds):
        group = [r for r in runs if r["kind"] == kind]
        for proven, marker in ((True, "o"), (False, "x")):
            points = [(r["objects"] + k - len(kinds) / 2, r["cpu"]) for r in group if r["proven"] == proven]
            axes.plot(*np.array(points).reshape(-1, 2).T, marker, color=f"C{k}", markersize=4, alpha=0.7)
        axes.plot([], [], "o", color=f"C{k}", label=kind)
    if not all(r["proven"] for r in runs):
        axes.plot([], [], "x", color="grey", label="budget spent, not proven")
    axes.set(yscale="log", xlabel="objects", ylabel="CPU time, s", title="exact: time to proof")
    axes.set_xticks(sorted({r["objects"] for r in runs}))
    axes.legend(loc="lower right")
