"""The Universal Robots driver: worker processes, a supervisor, motions with deadlines, recovery."""
