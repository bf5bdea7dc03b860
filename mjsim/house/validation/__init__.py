"""Rules for models and episodes (docs/models.md). Each rule is a generator of findings."""
