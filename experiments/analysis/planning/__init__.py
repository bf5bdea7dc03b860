"""Planning of studies: power, cost and preregistration."""
