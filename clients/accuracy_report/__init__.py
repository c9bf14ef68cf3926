"""The accuracy report for people: its printed table and its figure."""
