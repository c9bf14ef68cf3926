"""One physical cause a file. Every module here is an effect, found by its name: see `effects_section` and `effect`."""
