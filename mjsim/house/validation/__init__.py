"""Rules of docs/models.md: generators of findings about houses, receptacles, objects and episodes."""
