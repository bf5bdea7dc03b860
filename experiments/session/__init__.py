"""Sessions of a participant and an assistant in the simulated world, and the films of these sessions.

Trials, replays and browser sessions all use the class `Session`.
"""
