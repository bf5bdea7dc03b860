"""Trials and batches of trials: settings, designs, execution and result tables."""
