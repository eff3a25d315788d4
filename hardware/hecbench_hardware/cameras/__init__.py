"""Cameras, one device per file."""
