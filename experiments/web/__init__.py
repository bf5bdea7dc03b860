"""A live trial in a browser: its server, worker processes and client, and pages that show recorded runs.

It serves visits, of `mjsim play` and of studies, without knowledge of them.
"""
