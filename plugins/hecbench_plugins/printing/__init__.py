"""Targets to print: the black shapes of each kind, and a page with them to scale."""
