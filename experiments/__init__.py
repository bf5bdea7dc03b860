"""Sessions, simulated participants, metrics, records and the command line."""
