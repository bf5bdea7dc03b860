"""The subcommands of `mjsim`, one module each."""
