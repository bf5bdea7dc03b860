"""The worker process, which simulates a session, draws its frames and writes its journal.

The server starts one worker per session and forwards the worker's messages to the browser.
"""
