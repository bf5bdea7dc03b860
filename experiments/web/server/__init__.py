"""The server for live trials, with WebSockets, sessions, a queue for slots, and a pool of workers.

The server validates all messages from browsers. The workers run the simulations.
"""
