"""Sessions: a scene that sounds, its changes, its pace and its end; HTTP streams and live connections share them."""
