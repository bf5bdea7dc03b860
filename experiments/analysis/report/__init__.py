"""Reports of a study: page, figures, and checks of assumptions."""
