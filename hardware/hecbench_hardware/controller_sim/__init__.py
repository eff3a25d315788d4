"""A simulated Universal Robots controller that speaks the real one's protocols to the unmodified client."""
