"""Power, cost and preregistration of studies."""
