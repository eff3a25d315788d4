"""Other people's formats: one file per format, each a plugin."""
