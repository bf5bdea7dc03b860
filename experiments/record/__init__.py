"""Write, read and verify the records of sessions, and compute metrics from them."""
