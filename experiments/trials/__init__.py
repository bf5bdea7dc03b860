"""Trials and batches of them: what they are, how they are run, and what is kept of them."""
