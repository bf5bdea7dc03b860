"""The contents of the two hands: the knapsack of PAPER section 3.3, of capacity two there."""

from dataclasses import dataclass, replace

from mjsim.values.episode import CAPACITY
from mjsim.values.errors import ActionError

LEFT, RIGHT = 0, 1


@dataclass(frozen=True)
class Inventory:
    """Contents of the left and the right hand: an instance name or None; with `capacity` 1, the right hand does all.

    `ActionError` where both hands would hold the same object.
    """

    left: str | None = None
    right: str | None = None
    capacity: int = CAPACITY

    def __post_init__(self) -> None:
        if self.left is not None and self.left == self.right:
            raise ActionError(f"both hands cannot hold {self.left!r}; give each hand its own object")

    @property
    def hands(self) -> tuple[str | None, str | None]:
        """Contents, left before right."""
        return (self.left, self.right)

    @property
    def carried(self) -> tuple[str, ...]:
        """Names of what is held, left before right."""
        return tuple(name for name in self.hands if name is not None)

    @property
    def free_hands(self) -> tuple[int, ...]:
        """Hands that can take something: 0 left, 1 right."""
        usable = (LEFT, RIGHT) if self.capacity > 1 else (RIGHT,)
        return tuple(hand for hand in usable if self.hands[hand] is None)

    def hand_of(self, name: str) -> int | None:
        """Hand that holds `name`, or None."""
        return self.hands.index(name) if name in self.hands else None

    def take(self, hand: int, name: str) -> "Inventory":
        """With `name` in `hand`; `ActionError` where it is full, or the other hand already holds `name`."""
        if self.hands[hand] is not None:
            raise ActionError(
                f"hand {hand} already holds {self.hands[hand]!r}; release it before taking {name!r}"
            )
        return replace(self, left=name) if hand == LEFT else replace(self, right=name)

    def release(self, name: str) -> "Inventory":
        """Without `name`; `ActionError` where neither hand holds it."""
        hand = self.hand_of(name)
        if hand is None:
            raise ActionError(f"no hand holds {name!r}; the hands hold {self.hands}")
        return replace(self, left=None) if hand == LEFT else replace(self, right=None)
