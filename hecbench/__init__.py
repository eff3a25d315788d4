"""hecbench: hand-eye calibrators of every kind on the same recordings, by the same rulers."""

__version__ = "0.1.0"
