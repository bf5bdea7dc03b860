"""A session: the loop of participant, assistant and world, the participant's percept, and films.

Trials, replays and the browser's worker run the same `Session`.
"""
