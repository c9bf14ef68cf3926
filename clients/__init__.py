"""clients: what people hold; today the command line `ridgewave` (`python -m clients` is the same program).

The house's last room: it may import `service` and `synth`, and nothing imports it. Everything heavy is imported inside
the command that needs it, so that `ridgewave --help` answers at once.
"""
