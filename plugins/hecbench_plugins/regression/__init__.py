"""The camera's pose straight from one picture and the joints, by a small network (after Valassakis et al. 2021).

`virtual_camera` makes pictures of any camera alike, `answer` says what the network's numbers mean, `training` fits it
to drawn pictures after `sketches` of keypoints alone, `model` runs it by OpenCV, `combining` makes one camera of many
answers.
"""
