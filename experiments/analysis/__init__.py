"""Statistics, figures and pages made from records."""
