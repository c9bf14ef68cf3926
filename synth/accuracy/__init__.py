"""The cost of accuracy: error and time of each method, and the cost of a plan."""
