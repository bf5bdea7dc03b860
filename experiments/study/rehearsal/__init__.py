"""Rehearse a study by sending simulated participants to its server."""
