"""What is known of touch, beside the output of the model: `python -m tests.fidelity` prints the table of docs."""
