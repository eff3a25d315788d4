"""An interpreter of URScript, as far as the simulated controller executes it."""
