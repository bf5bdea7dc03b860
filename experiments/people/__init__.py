"""Studies with people: the study file, recruitment, pay, data and the researcher's page."""
