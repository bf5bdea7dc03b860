"""The summary of a report in sentences."""

from collections.abc import Iterator, Mapping

import numpy as np

from experiments.analysis.page import freedom, p_text, shown
from experiments.analysis.statistics.effects import ALPHA, FTest
from experiments.analysis.study.analysis import ONE_WAY, TWO_WAY, Analysis, tests_of
from experiments.trials.design import counted


def summary(analysis: Analysis, labels: Mapping[str, str]) -> Iterator[str]:
    """Yield sentences that state the question, and the result for each measure. `labels` names the measures."""
    table = analysis.table
    conditions, levels = table.conditions(), table.levels()
    if len(conditions) < 2 or not labels:
        return
    yield (
        f"Question: do people with {_listed(conditions)} as assistance differ in {_listed(list(labels.values()))}? "
        f"The table has {len(table.rows)} trials with "
        f"{_listed([*map(str, levels[:-1]), counted(levels[-1], 'object')])}."
    )
    for name, label in labels.items():
        kind, objects = (TWO_WAY, None) if len(levels) > 1 else (ONE_WAY, levels[0])
        result = analysis.find(name, kind, objects)
        found = dict(tests_of(result)) if result is not None else {}
        if not isinstance(test := found.get("assistance"), FTest):
            yield f"{label}: no test was possible. The last section of this report gives the reason."
            continue
        decision = (
            "the conditions differ" if test.p < ALPHA else "no difference between the conditions was found"
        )
        means = {c: float(np.mean(values)) for c, values in table.groups(name).items()}
        each = ", ".join(f"{c} {shown(mean)}" for c, mean in means.items())
        yield (
            f"{label}: {decision}, F({freedom(test)}) = {shown(test.statistic)}, {p_text(test.p)}, "
            f"partial η² = {shown(test.eta_squared)}. Means: {each}."
        )


def _listed(names: list[str]) -> str:
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)
