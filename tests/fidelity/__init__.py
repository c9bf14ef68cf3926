"""What is known of touch, compared with the model's output: `python -m tests.fidelity` prints the table of docs."""
