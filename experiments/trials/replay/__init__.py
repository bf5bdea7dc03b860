"""Replays of recorded runs, which are simulated again, compared with the record, and filmed in other views."""
