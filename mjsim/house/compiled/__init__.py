"""The compiled house without objects and person: rooms, receptacles, floor, rays."""
