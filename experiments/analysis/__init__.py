"""Statistics, figures and reports computed from recorded trials."""
