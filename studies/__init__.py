"""What reproduces published results: their numbers, the score against them, calibration and worked examples.

Serves maintainers and readers of the paper from a checkout; it is not part of the wheel.
"""
