"""Studies with people: study file, recruitment, payments, data, rehearsal and the researcher's page."""
