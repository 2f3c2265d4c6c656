"""What a control makes of blocks: places of axes and tips, one after the other."""
