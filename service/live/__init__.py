"""The live protocol `ridgewave.v1`: a hand's motion in, its vibration out, over one WebSocket.

From the wire inwards:
    shell          a connection: one task reads, one writes; the only module here that awaits the network
    conversation   the state machine of a connection: no I/O, no clock
    messages       every message, as the JSON Schema that is served and checked against; `answers` writes the server's
    contact        the binary form of a contact update
    stream         what outlives a connection: voice, newest update, scene, the kept past; `counts` for the metrics
    changes        scenes opened and changed: slow, for threads
    account        what a connection tells the metrics and the log
    sessions       the streams of a process: admission, taking over, expiry, stop
"""
