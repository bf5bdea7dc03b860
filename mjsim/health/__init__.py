"""What the physics is watched for: penetration, weld errors, ejections, tunnelling."""
