"""Sample episodes, and compile them into MuJoCo scenes."""
