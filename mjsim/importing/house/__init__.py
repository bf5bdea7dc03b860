"""Import of houses: scenes of other simulators become a house that `mjsim check` accepts (docs/import.md)."""
