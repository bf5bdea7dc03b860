"""A worker process with the world, clock, frames and journal of one session.

The server starts a worker per session, and forwards its messages to the browser.
"""
