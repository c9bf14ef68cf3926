"""From contact to table: series over a period, mip levels, rows of load, the table, its error, file and reading."""
