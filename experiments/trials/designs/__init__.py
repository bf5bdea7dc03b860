"""Study files: designs, and which metrics are analysed."""

from pathlib import Path

FOLDER = Path(__file__).parent
