"""Server of live trials: WebSockets, sessions, the queue for slots, and the pool of workers.

The server validates all messages from browsers. Simulation takes place in the workers.
"""
