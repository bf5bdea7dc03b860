"""The record of a session: written while it runs, read, checked, exported to a run directory, and measured.

It serves trials and batches, sessions with people, replays, and every analysis of runs.
"""
