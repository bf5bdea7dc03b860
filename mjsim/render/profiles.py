"""How much a frame may cost and how good it looks."""

from dataclasses import dataclass

from mjsim.values.errors import RenderError

MAX_SIDE = 8192  # px, of a frame


@dataclass(frozen=True)
class RenderProfile:
    """Settings of the rasteriser.

    Attributes:
        name: Name under which records and error messages know the profile.
        supersampling: Colour is drawn at this multiple of the frame's size and area-reduced, 1 to 4.
        samples: Multisamples per pixel, 0 for none.
        shadow_size: Side of a shadow map in texels, 0 for no shadows.
        reflections: Whether reflective materials mirror the scene.
        skybox: Whether the model's skybox shows where nothing else does.
        textures: Whether materials show their textures.
        contact_shadows: Whether free objects near the floor get a dark spot under them; for profiles without
            shadow maps.
    """

    name: str
    supersampling: float = 1.0
    samples: int = 0
    shadow_size: int = 0
    reflections: bool = False
    skybox: bool = True
    textures: bool = True
    contact_shadows: bool = False

    def __post_init__(self) -> None:
        if not 1.0 <= self.supersampling <= 4.0:
            raise RenderError(
                f"profile {self.name!r}: supersampling must be 1 to 4, got {self.supersampling}"
            )
        if self.samples < 0 or self.shadow_size < 0:
            raise RenderError(
                f"profile {self.name!r}: samples and shadow_size must not be negative, "
                f"got {self.samples} and {self.shadow_size}"
            )


DRAFT = RenderProfile("draft", skybox=False, textures=False)
"""Flat colours."""
# Drawn at 800 x 600 for a frame of 640 x 480: smooth edges for 8 ms more on a CPU, where multisampling costs 40.
FAST = RenderProfile("fast", supersampling=1.25, contact_shadows=True)
"""Smooth edges and contact shadows, at little cost on a CPU."""
# Smaller shadow maps speckle the floors of a house of this size.
QUALITY = RenderProfile("quality", supersampling=1.5, samples=4, shadow_size=4096, reflections=True)
"""Multisampling, fine shadows and reflections."""

PROFILES = {profile.name: profile for profile in (DRAFT, FAST, QUALITY)}
"""Profiles by name."""


def resolve_profile(profile: str | RenderProfile) -> RenderProfile:
    """The profile itself, or the one of that name: `draft`, `fast` or `quality`; `RenderError` for another name."""
    if isinstance(profile, RenderProfile):
        return profile
    if profile not in PROFILES:
        raise RenderError(f"no render profile {profile!r}; there are {sorted(PROFILES)}")
    return PROFILES[profile]
