"""Live trials in a browser: server, worker processes, client, and pages that show recorded runs.

The package serves `mjsim play` and studies, but imports neither.
"""
