"""The subcommands of `mjsim study` that need the published study. They serve `mjsim` in a checkout."""
