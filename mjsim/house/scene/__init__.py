"""A composed house: sampled episodes, settled objects, the person's body, and the compiled scene of all."""
