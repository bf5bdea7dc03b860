"""Run studies with human participants, from rehearsals and recruitment to payments and data export."""
