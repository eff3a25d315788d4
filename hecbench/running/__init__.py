"""From what a user names to tasks, and from tasks to estimates."""
