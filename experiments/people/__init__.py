"""Studies with people: the study file, phases, the store, the server, recruitment."""
