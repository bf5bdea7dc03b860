"""Settings for the size and appearance of films."""

from dataclasses import dataclass

from experiments.errors import ConfigError
from mjsim.render import PROFILES, RenderProfile

# Camera views from which a replay can be filmed
FIRST_PERSON, TOP_DOWN, FREE = CAMERAS = ("first-person", "top-down", "free")


@dataclass(frozen=True)
class FilmConfig:
    """Settings that determine the frames of a film.

    Attributes:
        width: Picture width in pixels.
        height: Picture height in pixels.
        profile: Render profile.
        beside: True if the panels of the HUD are next to the picture, as on the page of `mjsim play`. Frames are then
            larger than the picture.
        field_of_view: Horizontal field of view in radians, or None for that of the person.

    Raises:
        ConfigError: The render profile does not exist.
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
        """Margins in pixels above, below, left and right of the picture. They make the frame size even."""
        if not self.beside:
            return 0, 0, 0, 0
        from hud.layout import margins  # imported here so that the command line does not load it

        top, below, left, right = margins(self.width, self.height)
        return top + (self.height + top + below) % 2, below, left, right + (self.width + left + right) % 2

    @property
    def frame_size(self) -> tuple[int, int]:
        """Width and height of a frame in pixels."""
        top, below, left, right = self.margins
        return left + self.width + right, top + self.height + below
