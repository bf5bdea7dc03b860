from .analysis.comparison import compare, read_blocks
from .analysis.comparison_plot import draw_comparison
from .errors import ExperimentError
from .house import House
from .trials.batch import run_batch
from .trials.design import Design, factorial
from .trials.floor_plan import task_picture
from .trials.trial import run_trial
from .trials.trial_config import TrialConfig

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
