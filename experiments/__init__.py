"""Sessions, simulated participants, metrics, records and the command line."""

from typing import TYPE_CHECKING

from mjsim.support.lazy_names import lazy_names

__all__ = [
    "Design",
    "ExperimentError",
    "House",
    "TrialConfig",
    "compare",
    "draw_comparison",
    "factorial",
    "read_blocks",
    "run_batch",
    "run_trial",
    "task_picture",
]

if TYPE_CHECKING:
    from experiments.analysis.comparison import compare, read_blocks
    from experiments.analysis.comparison_plot import draw_comparison
    from experiments.errors import ExperimentError
    from experiments.house import House
    from experiments.trials.batch import run_batch
    from experiments.trials.design import Design, factorial
    from experiments.trials.floor_plan import task_picture
    from experiments.trials.trial import run_trial
    from experiments.trials.trial_config import TrialConfig
else:  # hidden from type checkers, which would otherwise accept any name
    __getattr__, __dir__ = lazy_names(
        __name__,
        {
            "analysis.comparison": ("compare", "read_blocks"),
            "analysis.comparison_plot": ("draw_comparison",),
            "errors": ("ExperimentError",),
            "house": ("House",),
            "trials.batch": ("run_batch",),
            "trials.design": ("Design", "factorial"),
            "trials.floor_plan": ("task_picture",),
            "trials.trial": ("run_trial",),
            "trials.trial_config": ("TrialConfig",),
        },
    )
