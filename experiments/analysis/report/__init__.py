"""Reports of a study: figures, assumptions and the page."""
