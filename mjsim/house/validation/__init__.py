"""The conventions of docs/models.md as rules: generators of findings about houses, receptacles, objects and episodes.

`mjsim check` and `mjsim import` report all findings; the first use of a user's house in a process stops at an error.
"""
