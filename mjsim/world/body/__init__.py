"""The person's body, hands and motions in the physics: picking, carrying, placing, and their rules.

Serves the tiers of `mjsim.world.fidelity`, which decide when the physics moves the person.
"""
