"""Times of reading and thinking."""

from dataclasses import dataclass

from experiments.participants.behaviour import varies


@dataclass(frozen=True)
class Timing:
    """Times of reading and deciding."""

    # factor of all these times for slow and quick people, log-SD 0.35
    pace: float = varies({"lognormal": [1.0, 0.35]}, 0.05, 20.0)
    # preparing one's next step mentally, s (Card, Moran and Newell, CACM 23, 1980: 1.35 s)
    deciding: float = varies(1.35, 0.0, 60.0, "s")
    # words a minute (Brysbaert, Journal of Memory and Language 109, 2019: 238)
    reading_speed: float = varies(238.0, 10.0, 10_000.0, "words a minute")
    words: float = varies(4.0, 0.0, 100.0)  # words in a row of the task list
    # taking in a suggested step with its path, before walking, s; a starting value
    guided_step: float = varies(6.0, 0.0, 60.0, "s")
    # telling one flagpole from the others and fitting them into the house, before a choice, s; a starting
    # value
    interpreting: float = varies({"uniform": [1.5, 3.0]}, 0.0, 60.0, "s")

    def list_time(self, rows: int) -> float:
        """Time to read a list with this number of rows, s."""
        return self.pace * rows * self.words / self.reading_speed * 60.0

    def choice_time(self, *, poles: bool) -> float:
        """Time to choose the next visit, with flagpoles to interpret or without, s."""
        return self.pace * (self.deciding + (self.interpreting if poles else 0.0))

    def suggestion_time(self) -> float:
        """Time to take in a suggested step, s."""
        return self.pace * self.guided_step
