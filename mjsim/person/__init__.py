"""The person's body, hands and motions in the physics."""
