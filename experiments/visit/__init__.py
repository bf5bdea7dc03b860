"""One participant's visit: plan, phases, server and store. `mjsim play` needs only this."""
