"""Form items, which are the questions of a form. They are defined in text files."""

from typing import Annotated, Any, Literal

import msgspec

Kind = Literal["scale", "choice", "several", "number", "line", "text"]
MAX_LINE, MAX_TEXT = 200, 2000  # maximum lengths of answers, in characters
NAME = r"^[a-z][a-z0-9_]{0,39}\Z"


class Item(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A question in a form.

    Attributes:
        name: Name of the item, which is also used to name columns of exported tables.
        kind: Type of the answer: `scale` (a point from 1), `choice` or `several` (of `choices`), `number` (an integer),
            `line` or `text`.
        right: Right answer of an attention or comprehension check. For a scale, this is the number of the point.
    """

    name: Annotated[str, msgspec.Meta(pattern=NAME)]
    kind: Kind
    text: str
    choices: list[str] = []
    low: int = 0
    high: int = 1_000_000
    required: bool = True
    right: str | int | None = None

    def __post_init__(self) -> None:
        chosen = self.kind in ("choice", "several")
        if chosen and len(set(self.choices)) < max(2, len(self.choices)):
            raise ValueError(f"item {self.name!r} needs two choices or more, all different")
        if not chosen and self.choices:
            raise ValueError(f"item {self.name!r} is a {self.kind} and has choices; make it a choice")
        if self.kind == "choice" and self.right is not None and self.right not in self.choices:
            raise ValueError(f"the right answer {self.right!r} of item {self.name!r} is none of its choices")
        if self.low > self.high:
            raise ValueError(f"item {self.name!r} has low {self.low} above high {self.high}")

    def is_wrong(self, answer: Any) -> bool:
        """Return True if the item has a right answer and `answer` differs from it."""
        return self.right is not None and answer != self.right

    def example(self) -> str:
        """Return a valid answer as form input. If the item has a right answer, return the right answer."""
        if self.right is not None:
            return str(self.right)
        match self.kind:
            case "choice" | "several":
                return self.choices[0]
            case "number":
                return str(self.low)
            case "scale":
                return "1"
        return "-"
