"""The phases before the task: a story, a fly-through of the house, a training trial (PAPER section 7).

Serves trials, `mjsim flythrough` and `mjsim play`.
"""
