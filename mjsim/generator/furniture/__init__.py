"""Parametric furniture: kinds, and the pieces that a generator draws of them."""
