"""Records of sessions: writing, export, reading, verification and metrics."""
