"""Observations computed from rawer ones before any solver runs, one kind per file."""
