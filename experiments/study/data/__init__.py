"""Data of a study: collect, export, copy, erase and forget."""
