"""Path following: looking ahead, slowing down at corners, and walking around objects on the floor."""
