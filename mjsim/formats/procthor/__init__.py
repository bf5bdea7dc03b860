"""Reader and writer of ProcTHOR's house JSON."""
