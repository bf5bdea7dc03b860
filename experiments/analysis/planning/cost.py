"""Cost of the participants of a study."""

import math
from dataclasses import dataclass

from experiments.errors import ConfigError


@dataclass(frozen=True)
class StudyCost:
    """Pay, fees and time of participants."""

    # for one person who finishes, in any currency
    pay: float = 7.5  # PAPER section 7
    fee: float = 0.0  # fee of the platform as a share of the pay
    # duration for one person
    minutes: float = 25.0  # PAPER section 7
    dropout: float = 0.15  # share of the people who start and do not finish

    def __post_init__(self) -> None:
        for name in ("pay", "fee", "minutes", "dropout"):
            value = getattr(self, name)
            if not 0 <= value < (1 if name == "dropout" else math.inf):
                raise ConfigError(
                    f"{name} is {value:g}; it must be 0 or more{', below 1' * (name == 'dropout')}"
                )

    def total(self, people: int) -> float:
        """Cost of this number of people who finish."""
        return people * self.pay * (1 + self.fee)

    def hours(self, people: int) -> float:
        """Hours of this number of people who finish and of those who do not."""
        return self.to_recruit(people) * self.minutes / 60

    def to_recruit(self, people: int) -> int:
        """Number of people who must start."""
        return math.ceil(people / (1 - self.dropout) - 1e-9)
