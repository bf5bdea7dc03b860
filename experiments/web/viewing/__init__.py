"""Pages that show recorded runs (`mjsim view`) and many homes (`mjsim house gallery`)."""
