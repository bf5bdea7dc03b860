"""Statistics of between-subjects studies, computed from plain arrays. Some require statsmodels (extra `study`)."""
