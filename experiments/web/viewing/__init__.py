"""Web pages that show recorded runs (`mjsim view`) or a gallery of homes (`mjsim house gallery`)."""
