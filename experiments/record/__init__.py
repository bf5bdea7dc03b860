"""The record of a session: written while it runs, then exported, read, verified and measured."""
