"""Fitting the guest to the published rows at 6 objects, by a surrogate of its trials."""
