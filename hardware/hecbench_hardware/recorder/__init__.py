"""Making recordings: a plan of poses, the motions, the frames, and a folder that survives a crash."""
