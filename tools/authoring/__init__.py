"""Scripts that author the data under ``models/``; nothing here runs with the simulator."""
