"""Subcommands of `mjsim study` that need the published results. They work only in a checkout."""
