"""Load the catalogues of houses, parse house names and read MJCF files."""
