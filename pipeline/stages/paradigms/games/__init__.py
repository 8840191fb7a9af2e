"""Games of several agents: repeated matrix games and the paper's grid world."""
