"""What is simulated step by step: contacts with mass, memory or adhesion, whose z is no function of place and load."""

from pathlib import Path

from synth.contact import kernels

HERE = Path(__file__).parent
kernels.forget_stale_kernels(HERE)
kernels.forget_stale_kernels(HERE, called=kernels.HERE)
