"""What surrounds the visits of a study: its file, recruitment, payments, data, rehearsal and the researcher's page."""
