"""Studies with people: the study file, phases, the store, the server, recruitment."""

from pathlib import Path

TEMPLATE = Path(__file__).with_name("study.toml")  # of `mjsim study init`
VISITS = "visits"  # folder of journals and runs in the folder of a study
