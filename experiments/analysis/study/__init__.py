"""Analysis of a study's table: measures, models and tests."""
