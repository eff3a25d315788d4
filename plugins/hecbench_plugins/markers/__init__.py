"""What the marker-based solvers share."""
