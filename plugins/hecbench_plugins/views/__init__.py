"""What renderer methods compare: pictures, pyramids, silhouettes, shared backgrounds."""
