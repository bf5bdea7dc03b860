"""File formats of houses and scenes, each with its readers and writers. Readers return a `SourceScene`."""
