"""Generate furnished homes from a seed. A seed gives the same files in every process."""
