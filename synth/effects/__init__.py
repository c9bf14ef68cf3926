"""One physical cause per file. Every module except `effect` is an effect, found by its name (`effects_section`)."""
