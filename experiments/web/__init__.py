"""A live trial in a browser: server, worker processes, client, and pages that show recorded runs.

It serves visits of `mjsim play` and of studies, and imports neither.
"""
