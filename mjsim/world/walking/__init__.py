"""Path following, which includes slowing down at corners and walking around objects on the floor."""
