"""Robot models from URDF files, their meshes, and the robot of a recording in its poses."""
