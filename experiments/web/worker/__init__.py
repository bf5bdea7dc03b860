"""Worker process with the world, clock, frames and journal of one session.

The server starts one worker per session and forwards its messages to the browser.
"""
