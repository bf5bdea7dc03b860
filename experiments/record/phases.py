"""The phases of a session: names, order, and which of them a trial has."""

from experiments.errors import ConfigError

STORY, FLYTHROUGH, TRAINING, TASK = PHASES = ("story", "flythrough", "training", "task")


def phases_of(text: str) -> tuple[str, ...]:
    """The phases that a text such as `flythrough,task` names.

    Raises:
        ConfigError: There is no such phase, they are not in their order, or the task is missing.
    """
    names = tuple(part.strip() for part in text.split(","))
    unknown = [name for name in names if name not in PHASES]
    if unknown:
        raise ConfigError(f"no phase {unknown[0]!r}; there are {', '.join(PHASES)}")
    if names != tuple(name for name in PHASES if name in names) or names[-1] != TASK:
        raise ConfigError(
            f"phases are {','.join(names)!r}; name each at most once, in the order {','.join(PHASES)}, "
            "with the task last"
        )
    return names
