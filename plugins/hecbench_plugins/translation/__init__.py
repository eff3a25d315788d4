"""Image-to-image translation by adversarial networks, as published: networks, losses, training, running by OpenCV."""
