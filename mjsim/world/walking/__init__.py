"""How a person follows a path on the floor: looks ahead, slows down at corners, passes objects beside the feet.

It serves `mjsim.world.world`, which carries out the action `FollowPath`, and participants that measure along paths.
"""
