"""Robot arms behind one `Robot` protocol."""
