"""Rulers, one metric family per file."""
