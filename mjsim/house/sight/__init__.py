"""What a person can see in a house, and how high a receptacle is filled."""
