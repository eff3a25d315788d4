"""Image translation from real to simulated, one method per file."""
