"""The server of live trials: WebSockets, sessions, the queue for slots, and the pool of workers.

It simulates nothing and validates everything that browsers send.
"""
