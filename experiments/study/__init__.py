"""Studies with human participants: study file, recruitment, payments, data, rehearsal and researcher's page."""
