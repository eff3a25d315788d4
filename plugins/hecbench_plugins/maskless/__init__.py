"""Calibration from raw photographs: no masks, no markers, no training, a rough start or none."""
