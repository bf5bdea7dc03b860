"""Plan studies: statistical power, cost and preregistration."""
