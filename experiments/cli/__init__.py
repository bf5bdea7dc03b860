"""The subcommands of `mjsim`, one module each.

Serves users at a terminal; commands import the rest only when they run, so that help is quick.
"""
