"""Rehearsals, in which simulated participants visit a study's real server."""
