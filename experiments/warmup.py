"""Compiles the kernels of participants ahead of the first trial; numba keeps them on disk for every later process.

Run once after installing: `python -m experiments.warmup`.
"""

from experiments.house import House
from experiments.participants import DEFAULT_FOR_ASSISTANCE
from experiments.records import EventLog
from experiments.trial import TrialConfig, prepare_session
from mjsim.model.scene import compose

STEPPED, FORESEEN = ("full", 2.0), ("event", 60.0)  # how far a trial is played, s


def compile_kernels(house: House | None = None) -> None:
    """Play the beginning of a trial with every kind of participant, step by step and foreseen."""
    house = house or House.load()
    scene = compose(house.sample_episode(objects=2, seed=0), house.catalogue)
    for assistance in DEFAULT_FOR_ASSISTANCE:
        for fidelity, until in (STEPPED, FORESEEN):
            config = TrialConfig(
                objects=2, assistance=assistance, seed=0, fidelity=fidelity, time_limit=until, regret=False
            )
            prepare_session(config, house, scene, EventLog())[0].run()


if __name__ == "__main__":
    compile_kernels()
