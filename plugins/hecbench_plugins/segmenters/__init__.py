"""Where the robot is in the images: one way per file."""
