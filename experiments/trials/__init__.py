"""Trials and batches of trials: their settings and designs, how they are run and resumed, and their tables.

Serves `mjsim run` and `mjsim batch`, and studies, which are batches of simulated people.
"""
