"""The live protocol `ridgewave.v1`: a hand's motion in, its vibration out, over one WebSocket.

From the wire inwards:
    websocket          the server's end of a WebSocket: handshake, pings, close; `websocket_frames` reads its frames
    transport          what a connection needs of it: messages in and out
    connection         a connection: one task reads, one writes; the only module here that awaits the network
    conversation       the state machine of a connection: no I/O, no clock
    messages           every message, as the JSON Schema that is served and checked against
    server_messages    writes those of the server
    contact_update     the binary form of a contact update
    live_connections   the connections of a process: admitted, given a session, watched
    live_stream        what outlives a connection: voice, newest update, and the PCM that is kept to be resumed
    silence_watchdog   lifts a hand that is not heard
    live_metrics       what a stream and its connection tell the metrics and the log
    message_limits     how much a connection may send
"""
