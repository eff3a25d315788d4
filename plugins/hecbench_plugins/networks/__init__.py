"""Trained networks that come with this package, one per file, with weights and model card in a folder beside it."""
