"""File formats of houses and scenes."""
