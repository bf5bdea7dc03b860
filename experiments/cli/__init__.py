"""Subcommands of `mjsim`. Each module delays slow imports until the command runs, to keep `--help` fast."""
