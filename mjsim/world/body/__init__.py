"""The person's body and hands in full physics: picking, carrying and placing objects."""
