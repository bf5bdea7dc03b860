"""What comes before the task: its story, a fly-through of the house, a training trial (PAPER section 7)."""
