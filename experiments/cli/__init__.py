"""The subcommands of `mjsim`, one module each. They import most code only when they run, so that `--help` is fast."""
