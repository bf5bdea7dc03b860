"""A worker process: one world with one session, its clock, its frames and its journal.

It serves the server, which starts one for each session and forwards its messages to the browser.
"""
