"""The objects in a person's hands (the knapsack in section 3.3 of PAPER)."""

from dataclasses import dataclass, replace

from mjsim.values.episode import CAPACITY
from mjsim.values.errors import ActionError

LEFT, RIGHT = 0, 1


@dataclass(frozen=True)
class Inventory:
    """The instance names of the objects in a person's hands, or None for a free hand.

    If `capacity` is 1, only the right hand is used.

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
        """The indices of the free hands that can be used: 0 for the left hand, 1 for the right hand."""
        usable = (LEFT, RIGHT) if self.capacity > 1 else (RIGHT,)
        return tuple(hand for hand in usable if self.hands[hand] is None)

    def hand_of(self, name: str) -> int | None:
        return self.hands.index(name) if name in self.hands else None

    def take(self, hand: int, name: str) -> "Inventory":
        """Return a copy with an object in a hand. Raise an ActionError if the hand is not free."""
        if self.hands[hand] is not None:
            raise ActionError(
                f"hand {hand} already holds {self.hands[hand]!r}; release it before taking {name!r}"
            )
        return replace(self, left=name) if hand == LEFT else replace(self, right=name)

    def release(self, name: str) -> "Inventory":
        """Return a copy without an object. Raise an ActionError if neither hand holds the object."""
        hand = self.hand_of(name)
        if hand is None:
            raise ActionError(f"no hand holds {name!r}; the hands hold {self.hands}")
        return replace(self, left=None) if hand == LEFT else replace(self, right=None)
