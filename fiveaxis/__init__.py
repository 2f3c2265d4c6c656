"""fiveaxis: choose the tool posture of a 5-axis path that costs the machine the least energy."""
