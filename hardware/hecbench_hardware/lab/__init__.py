"""The virtual lab: a MuJoCo scene behind the same Robot, Camera and Gripper protocols as the real devices."""
