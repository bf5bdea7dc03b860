"""Settings for the size and appearance of films."""

from dataclasses import dataclass

from experiments.errors import ConfigError
from mjsim.render import PROFILES, RenderProfile

# Camera views from which a replay can be filmed
FIRST_PERSON, TOP_DOWN, FREE = CAMERAS = ("first-person", "top-down", "free")
FRAME_SIZE = (960, 540)  # default width and height of a frame with the panels of the HUD, in pixels


@dataclass(frozen=True)
class FilmConfig:
    """Settings that determine the frames of a film.

    Attributes:
        width: Width of a frame in pixels.
        height: Height of a frame in pixels.
        profile: Render profile.
        picture: Left edge, upper edge, width and height of the picture in a frame, in pixels. The panels of the HUD
            are next to it, as on the page of `mjsim play`. If it is None, the panels are over the picture.
        field_of_view: Horizontal field of view in radians, or None for that of the person.

    Raises:
        ConfigError: The render profile does not exist.
    """

    width: int = 640
    height: int = 480
    profile: str | RenderProfile = "fast"
    picture: tuple[int, int, int, int] | None = None
    field_of_view: float | None = None

    def __post_init__(self) -> None:
        if isinstance(self.profile, str) and self.profile not in PROFILES:
            raise ConfigError(f"no render profile {self.profile!r}; there are {', '.join(PROFILES)}")

    @classmethod
    def with_panels(
        cls, width: int = FRAME_SIZE[0], height: int = FRAME_SIZE[1], profile: str = "fast"
    ) -> "FilmConfig":
        """Return settings for frames with the panels of the HUD, which are next to the picture in wide frames."""
        from hud.layout import picture_rect  # imported here so that the command line does not load it

        rect = picture_rect(width, height)
        picture = None if rect is None else (rect.x, rect.y, rect.width, rect.height)
        return cls(width, height, profile, picture)

    @classmethod
    def around(cls, width: int, height: int, profile: str, field_of_view: float | None) -> "FilmConfig":
        """Return settings for frames of even size with the panels of the HUD around a picture of this size."""
        from hud.layout import margins

        top, below, left, right = margins(width, height)
        across, up = left + width + right, top + height + below
        picture = (left, top + up % 2, width, height)
        return cls(across + across % 2, up + up % 2, profile, picture, field_of_view)

    @property
    def view(self) -> tuple[int, int, int, int]:
        """The left edge, the upper edge, the width and the height of the picture in a frame, in pixels."""
        return self.picture or (0, 0, self.width, self.height)
