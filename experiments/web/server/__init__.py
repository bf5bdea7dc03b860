"""The server of live trials: sockets of browsers, sessions, the queue for slots, and the pool of workers.

It serves the visits of `mjsim play` and of studies; it simulates nothing and trusts no browser.
"""
