"""Whether a calibration is still true: the robot's contour in every frame, a test, the verb."""
