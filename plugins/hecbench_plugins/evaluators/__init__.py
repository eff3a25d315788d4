"""Evaluators, one metric family per file."""
