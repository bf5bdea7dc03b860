"""What people cost who take part in a study."""

import math
from dataclasses import dataclass

from experiments.errors import ConfigError


@dataclass(frozen=True)
class StudyCost:
    """What people cost.

    Attributes:
        pay: Of one person who finishes, in any currency.
        fee: What the platform takes on top, as a share of the pay.
        minutes: That one person takes.
        dropout: Share of the people who begin and do not finish.
    """

    pay: float = 7.5  # PAPER section 7
    fee: float = 0.0
    minutes: float = 25.0  # PAPER section 7
    dropout: float = 0.15

    def __post_init__(self) -> None:
        for name in ("pay", "fee", "minutes", "dropout"):
            value = getattr(self, name)
            if not 0 <= value < (1 if name == "dropout" else math.inf):
                raise ConfigError(
                    f"{name} is {value:g}; it must be 0 or more{', below 1' * (name == 'dropout')}"
                )

    def total(self, people: int) -> float:
        """Of so many people who finish."""
        return people * self.pay * (1 + self.fee)

    def hours(self, people: int) -> float:
        """Of so many people who finish and of those who do not."""
        return self.to_recruit(people) * self.minutes / 60

    def to_recruit(self, people: int) -> int:
        """How many people must begin."""
        return math.ceil(people / (1 - self.dropout) - 1e-9)
