"""The rendered robot against depth pictures: point-to-plane alignment, its verification, and starts for it."""
