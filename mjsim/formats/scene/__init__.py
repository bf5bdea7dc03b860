"""Types for imported scenes, and readers for mesh files."""
