"""Replay recorded runs in order to verify them or to film them in other views."""
