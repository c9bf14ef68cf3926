"""HTTP: the layers round the routes (Host, Origin, keys, rates, compression), bodies in, answers and streams out."""
