"""How far what is carried is from walls and furniture, for the houses of scenes."""

from mjsim.model.clearance import ClearanceField
from mjsim.model.house import compiled_house
from mjsim.model.scene import Scene

CARRY_BAND = (0.93, 1.60)  # heights of carried objects, m


def carry_clearance(scene: Scene) -> ClearanceField:
    """Clearance at the heights of what is carried; computed once per house."""
    low, high = CARRY_BAND
    return compiled_house(scene.catalogue).once(
        ("clearance", low, high), lambda: ClearanceField.from_model(scene.model, low=low, high=high)
    )
