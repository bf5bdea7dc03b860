"""Simulates recorded runs again: compares every control step, and films the run in other views.

It serves users who verify or film a run, and resumed sessions, which follow the plans of their log.
"""
