"""Web pages on which researchers monitor and control a study."""
