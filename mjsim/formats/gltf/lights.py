"""The lights that MuJoCo's renderer switches on."""

from typing import Any

import mujoco

_MOST = 8  # that OpenGL has, the one on the viewer's head included
_AMBIENT_ALONE = 0.3  # of a scene without any light
_COLOURS = ("ambient", "diffuse", "specular")
_KINDS = {mujoco.mjtLightType.mjLIGHT_SPOT: "spot", mujoco.mjtLightType.mjLIGHT_DIRECTIONAL: "directional"}


def lights_of(scene: Any) -> dict[str, Any]:
    """The `lights` of an `MjvScene`, in the house's frame, and the `headlight`, which shines along the view.

    Positions are in m, cutoffs in degrees; lights of other types (`point`, `image`) are not drawn by MuJoCo either.
    """
    drawn = scene.lights[: min(scene.nlight, _MOST)]
    headlight = next((_colours(light) for light in drawn if light.headlight), None)
    lights = [
        {
            "type": _KINDS[mujoco.mjtLightType(light.type)],
            "position": rounded(light.pos),
            "direction": rounded(light.dir),
            "cutoff": float(light.cutoff),
            "exponent": float(light.exponent),
            "attenuation": rounded(light.attenuation),
            **_colours(light),
        }
        for light in drawn
        if not light.headlight and mujoco.mjtLightType(light.type) in _KINDS
    ]
    if headlight is None:
        ambient = 0.0 if lights else _AMBIENT_ALONE
        headlight = {"ambient": [ambient] * 3, "diffuse": [0.0] * 3, "specular": [0.0] * 3}
    return {"lights": lights, "headlight": headlight}


def rounded(values: Any) -> list[float]:
    """Numbers for a file: to 1e-6."""
    return [round(float(value), 6) for value in values]


def _colours(light: Any) -> dict[str, list[float]]:
    return {name: rounded(getattr(light, name)) for name in _COLOURS}
