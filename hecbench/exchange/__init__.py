"""Other people's conventions and formats."""
