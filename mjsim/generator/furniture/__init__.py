"""Parametric furniture: functions that draw a random piece of each type."""
