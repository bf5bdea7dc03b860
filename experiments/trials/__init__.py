"""Trials and batches of trials: settings, designs, running and resuming them, and tables."""
