"""A reader and a writer for ProcTHOR houses, which are JSON files."""
