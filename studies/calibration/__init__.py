"""Fit the `guest` participant model to the published results at 6 objects, using a surrogate model."""
