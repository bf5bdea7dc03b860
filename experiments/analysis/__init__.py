"""Statistics, figures and pages made from records.

Serves `mjsim compare`, `mjsim check` and the analysis of studies.
"""
