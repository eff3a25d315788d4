"""What samples tell together: how far an answer may contradict them, which count once, and which stand for all."""
