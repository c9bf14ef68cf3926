"""HTTP: the layers round the routes (Host, Origin, keys, rates, compression), request bodies, and answers."""
