"""Trials: what a gripper achieves with a calibration."""
