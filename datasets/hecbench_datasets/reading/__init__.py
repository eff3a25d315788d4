"""What the adapters share: parsing of files, the user's hints, and pairing of pose streams."""
