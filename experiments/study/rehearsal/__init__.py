"""Rehearsals: simulated people go through a study's real server, before real people do."""
