"""Games that several agents play at once: repeated matrix games and the grid world of the paper."""
