"""Pages that show recorded runs (`mjsim view`) or many homes (`mjsim house gallery`)."""
