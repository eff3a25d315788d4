"""Starts from nothing: cameras all over a view sphere, judged by masks or by photographs."""
