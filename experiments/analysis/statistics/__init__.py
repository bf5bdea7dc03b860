"""Statistical tests and models for between-subjects studies. Some need statsmodels (extra `study`)."""
