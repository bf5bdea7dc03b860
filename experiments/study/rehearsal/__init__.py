"""Rehearsals: simulated participants on the study's real server."""
