"""What accuracy costs in time: methods against a reference, and the cost of a plan."""
