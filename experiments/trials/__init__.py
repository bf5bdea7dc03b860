"""Run single trials and batches of trials, and write tables of their results."""
