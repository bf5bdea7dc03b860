"""Planning of studies: power, homes, preregistration and cost."""
