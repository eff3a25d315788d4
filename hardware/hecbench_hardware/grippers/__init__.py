"""Grippers, one device per file."""
