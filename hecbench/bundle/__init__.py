"""Bundle adjustment of corners with corrections of the robot: shared by the bundle solvers and `check`."""
