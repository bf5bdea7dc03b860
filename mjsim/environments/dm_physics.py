"""The bridge to dm_control's tools."""

from typing import Any

from mjsim.world import World


def physics_of(world: World) -> Any:
    """A `dm_control.mujoco.Physics` of a running world, which shares its state; treat it as read-only.

    Importing dm_control settles its OpenGL backend by the variable `MUJOCO_GL`, so it waits until it is needed.
    """
    from dm_control import mujoco as dm_mujoco

    return dm_mujoco.Physics(dm_mujoco.wrapper.MjData(world.data))
