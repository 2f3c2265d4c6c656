"""The machine: form-shaping code, chain, axes, bodies, setup, files."""
