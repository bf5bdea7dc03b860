"""Sessions, in which a participant and an assistant act in the simulated world, and films of sessions.

Trials, replays and browser sessions all use the class `Session`.
"""
