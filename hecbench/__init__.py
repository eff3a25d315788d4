"""hecbench: hand-eye calibrators of every kind, measured on the same recordings."""

__version__ = "0.2.0"
