"""The figure and the table of what accuracy costs, from the JSON of an accuracy report."""
