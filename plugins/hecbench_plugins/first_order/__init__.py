"""The first-order markerless methods: a renderer that torch differentiates, poses, losses and Adam."""
