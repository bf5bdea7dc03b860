"""Reports on studies: the page, its figures, and checks of assumptions."""
