"""Shows recorded runs in the browser: `mjsim view`."""
