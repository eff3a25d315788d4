"""Seeing a robot in photographs by one small network: its mask, its colours as drawn, and points of its skeleton.

`family` says what the network is taught about a robot, `pictures` draws the examples, `training` fits the network,
`model` runs it by OpenCV alone.
"""
