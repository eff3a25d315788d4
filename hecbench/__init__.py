"""hecbench: hand-eye calibrators, marker-based and markerless, on the same recordings and by the same rulers."""

__version__ = "0.1.0"
