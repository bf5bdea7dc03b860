"""Size and look of the frames of a film."""

from dataclasses import dataclass

from experiments.errors import ConfigError
from mjsim.render import PROFILES, RenderProfile

FIRST_PERSON, TOP_DOWN, FREE = CAMERAS = ("first-person", "top-down", "free")  # of a film of a replay


@dataclass(frozen=True)
class FilmConfig:
    """How frames are made: size in px, and the render profile.

    Raises:
        ConfigError: There is no such profile.
    """

    width: int = 640
    height: int = 480
    profile: str | RenderProfile = "fast"

    def __post_init__(self) -> None:
        if isinstance(self.profile, str) and self.profile not in PROFILES:
            raise ConfigError(f"no render profile {self.profile!r}; there are {', '.join(PROFILES)}")
