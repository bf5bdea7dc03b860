"""Statistics of between-subjects studies, on plain arrays. statsmodels comes with the extra `study`."""
