"""Live trials in a browser: server, worker processes, client, and pages that show recorded runs.

The package is used by `mjsim play` and by studies, but it imports neither of them.
"""
