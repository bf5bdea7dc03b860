"""Proven optimal tours for capacity two, and how close to optimal the best known tour is until then."""
