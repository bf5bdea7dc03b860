"""Compare studies with the published results: scoring, calibration and worked examples.

This package is for maintainers and readers of the paper who work in a checkout. It is not part of the wheel.
"""
