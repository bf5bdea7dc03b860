"""Study files: designs, published numbers, and which metrics are scored."""

from pathlib import Path

FOLDER = Path(__file__).parent
