"""Whether a study is ready for people: `mjsim study check`."""
