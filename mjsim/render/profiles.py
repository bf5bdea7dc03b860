"""Render profiles, which trade image quality for speed."""

from dataclasses import dataclass

from mjsim.values.errors import RenderError

MAX_SIDE = 8192  # largest side of a frame, in pixels


@dataclass(frozen=True)
class RenderProfile:
    """Settings of the rasteriser.

    Attributes:
        name: Name in records and error messages.
        supersampling: Factor, 1 to 4, by which frames are drawn larger before they are reduced.
        samples: Multisamples per pixel, 0 for none.
        shadow_size: Side of a shadow map in texels, 0 for no shadows.
        reflections: True if reflective materials mirror the scene.
        skybox: True if the model's skybox is drawn.
        textures: True if materials show their textures.
        contact_shadows: True for dark spots under free objects near the floor, for profiles without shadow maps.
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
"""Flat colours without textures."""
# A frame of 640 x 480 is drawn at 800 x 600. On a CPU, this costs 8 ms, and multisampling would cost 40 ms.
FAST = RenderProfile("fast", supersampling=1.25, contact_shadows=True)
"""Smooth edges and contact shadows, at little cost on a CPU."""
# Smaller shadow maps cause speckled floors.
QUALITY = RenderProfile("quality", supersampling=1.5, samples=4, shadow_size=4096, reflections=True)
"""Multisampling, fine shadows and reflections."""

PROFILES = {profile.name: profile for profile in (DRAFT, FAST, QUALITY)}
"""Profiles by name."""


def resolve_profile(profile: str | RenderProfile) -> RenderProfile:
    """Return the profile of a given name, or a given profile. Raise a RenderError for an unknown name."""
    if isinstance(profile, RenderProfile):
        return profile
    if profile not in PROFILES:
        raise RenderError(f"no render profile {profile!r}; there are {sorted(PROFILES)}")
    return PROFILES[profile]
