"""One session: the loop in which a participant, an assistant and a world take turns, what it perceives, and films.

Serves trials, replays and the browser's worker, which all run the same `Session`.
"""
