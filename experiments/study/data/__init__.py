"""Collection, export and deletion of study data."""
