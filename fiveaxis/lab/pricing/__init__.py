"""What programs cost: their energy, block by block, and where they are slow."""
