"""Statistics of studies between subjects, on plain arrays: tests, effect sizes, models, power.

For `mjsim study` and the scripts in `studies/`. statsmodels comes with the extra `study`.
"""
