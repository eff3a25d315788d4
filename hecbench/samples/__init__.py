"""What samples tell together: how far an answer may contradict them, and which of them count once."""
