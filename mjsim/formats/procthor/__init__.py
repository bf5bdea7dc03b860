"""Reader and writer for ProcTHOR's house JSON."""
