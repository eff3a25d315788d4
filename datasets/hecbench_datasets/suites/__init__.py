"""Generated recordings: one file per suite, each a plugin."""
