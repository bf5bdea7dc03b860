"""Objects in a person's hands (the knapsack of PAPER section 3.3)."""

from dataclasses import dataclass, replace

from mjsim.values.episode import CAPACITY
from mjsim.values.errors import ActionError

LEFT, RIGHT = 0, 1


@dataclass(frozen=True)
class Inventory:
    """Instance names of the objects in the hands. A free hand is None. With `capacity` 1, the left hand stays free.

    Raises:
        ActionError: Both hands hold the same object.
    """

    left: str | None = None
    right: str | None = None
    capacity: int = CAPACITY

    def __post_init__(self) -> None:
        if self.left is not None and self.left == self.right:
            raise ActionError(f"both hands cannot hold {self.left!r}; give each hand its own object")

    @property
    def hands(self) -> tuple[str | None, str | None]:
        return (self.left, self.right)

    @property
    def carried(self) -> tuple[str, ...]:
        return tuple(name for name in self.hands if name is not None)

    @property
    def free_hands(self) -> tuple[int, ...]:
        """Indices of the usable free hands: 0 for left, 1 for right."""
        usable = (LEFT, RIGHT) if self.capacity > 1 else (RIGHT,)
        return tuple(hand for hand in usable if self.hands[hand] is None)

    def hand_of(self, name: str) -> int | None:
        return self.hands.index(name) if name in self.hands else None

    def take(self, hand: int, name: str) -> "Inventory":
        """Return a copy with `name` in `hand`. Raise an ActionError if the hand is full or `name` is already held."""
        if self.hands[hand] is not None:
            raise ActionError(
                f"hand {hand} already holds {self.hands[hand]!r}; release it before taking {name!r}"
            )
        return replace(self, left=name) if hand == LEFT else replace(self, right=name)

    def release(self, name: str) -> "Inventory":
        """Return a copy without `name`. Raise an ActionError if neither hand holds it."""
        hand = self.hand_of(name)
        if hand is None:
            raise ActionError(f"no hand holds {name!r}; the hands hold {self.hands}")
        return replace(self, left=None) if hand == LEFT else replace(self, right=None)
