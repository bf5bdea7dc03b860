"""Houses in the formats of other simulators, for `mjsim house export` (docs/houses.md); needs the extra `import`."""
