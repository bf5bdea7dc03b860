"""The environment's entry in Gymnasium's registry."""

from gymnasium.envs.registration import register, registry

ENVIRONMENT_ID = "mjsim/Rearrange-v0"


def register_environments() -> None:
    """Make `gymnasium.make("mjsim/Rearrange-v0")` work; again does nothing. Imports none of the simulator."""
    if ENVIRONMENT_ID not in registry:
        register(id=ENVIRONMENT_ID, entry_point="mjsim.environments.gymnasium_environment:RearrangeEnv")
