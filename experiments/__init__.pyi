from .analysis.comparison import compare as compare, read_blocks as read_blocks
from .analysis.comparison_plot import draw_comparison as draw_comparison
from .errors import ExperimentError as ExperimentError
from .house import House as House
from .trials.batch import run_batch as run_batch
from .trials.design import Design as Design, factorial as factorial
from .trials.floor_plan import task_picture as task_picture
from .trials.trial import run_trial as run_trial
from .trials.trial_config import TrialConfig as TrialConfig
