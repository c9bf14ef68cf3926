"""What is simulated step by step: contacts with mass, memory or adhesion, whose z is no function of place and load."""
