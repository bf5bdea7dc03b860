"""Episode scenes: sampling, settling of dropped objects, the person's body, and compilation."""
