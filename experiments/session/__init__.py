"""One session: the loop of participant, assistant and world, what the participant perceives, and films.

Trials, replays and the browser's worker run the same `Session`.
"""
