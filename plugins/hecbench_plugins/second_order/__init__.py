"""`render_gn`: Gauss-Newton alignment of the drawn robot with masks and pictures."""
