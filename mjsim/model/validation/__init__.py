"""What houses, receptacles, objects and episodes have to be like, as docs/models.md states it; run by `mjsim check`
and by whatever loads them.
"""
