"""The person's body, hands and motions in full physics: picking, carrying and placing."""
