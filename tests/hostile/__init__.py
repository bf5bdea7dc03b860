"""Hostile inputs of all commands, and the processes in which they are tried."""
