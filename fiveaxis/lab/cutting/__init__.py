"""Power of milling and drilling by published models; the budget of a job."""
