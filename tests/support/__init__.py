"""What tests and benchmarks share: paths, parts, programs, and judges that take nothing from the package."""
