"""Statistics of between-subjects studies on plain arrays. Some need statsmodels, from the extra `study`."""
