"""Access to the database of a study. Other packages never access the database directly."""

from experiments.visit.store.copies import restore as restore
from experiments.visit.store.store import Store as Store
from experiments.visit.store.store import change_database as change_database
from experiments.visit.store.values import Answer as Answer
from experiments.visit.store.values import Assignment as Assignment
from experiments.visit.store.values import CellQuota as CellQuota
from experiments.visit.store.values import Counts as Counts
from experiments.visit.store.values import PaymentEvent as PaymentEvent
from experiments.visit.store.values import PersonRow as PersonRow
from experiments.visit.store.values import PhaseRow as PhaseRow
from experiments.visit.store.values import Researcher as Researcher
from experiments.visit.store.values import Role as Role
from experiments.visit.store.values import Rule as Rule
from experiments.visit.store.values import Status as Status
from experiments.visit.store.values import StudyState as StudyState
from experiments.visit.store.values import TrialRow as TrialRow
from experiments.visit.store.values import utc_now as utc_now
