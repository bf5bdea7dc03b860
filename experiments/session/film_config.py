"""Size and look of the frames of a film."""

from dataclasses import dataclass

from experiments.errors import ConfigError
from mjsim.render import PROFILES, RenderProfile

FIRST_PERSON, TOP_DOWN, FREE = CAMERAS = ("first-person", "top-down", "free")  # of a film of a replay


@dataclass(frozen=True)
class FilmConfig:
    """How frames are made.

    Attributes:
        width: Of the picture, px.
        height: Of the picture, px.
        profile: Render profile.
        beside: Whether lists and hands of the HUD lie beside the picture, as on the page of `mjsim play`: frames are
            then larger than the picture.
        field_of_view: Horizontal field of view of the picture, rad; None for that of the person.

    Raises:
        ConfigError: There is no such profile.
    """

    width: int = 640
    height: int = 480
    profile: str | RenderProfile = "fast"
    beside: bool = False
    field_of_view: float | None = None

    def __post_init__(self) -> None:
        if isinstance(self.profile, str) and self.profile not in PROFILES:
            raise ConfigError(f"no render profile {self.profile!r}; there are {', '.join(PROFILES)}")

    @property
    def margins(self) -> tuple[int, int, int, int]:
        """Room above, below, to the left and to the right of the picture, px; frames of films have even sizes."""
        if not self.beside:
            return 0, 0, 0, 0
        from hud.layout import (
            margins,
        )  # imported late: it takes long, and the command line needs the rest at once

        top, below, left, right = margins(self.width, self.height)
        return top + (self.height + top + below) % 2, below, left, right + (self.width + left + right) % 2

    @property
    def frame_size(self) -> tuple[int, int]:
        """Width and height of a frame, px."""
        top, below, left, right = self.margins
        return left + self.width + right, top + self.height + below
