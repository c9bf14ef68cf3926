"""The live protocol, `ridgewave.v1` and `ridgewave.v2`: the motion of a hand in, its vibration out, over one WebSocket.

From the network inwards:
    websocket             the server's end of a WebSocket: sending, pings, close
    websocket_handshake   the upgrade request and its answer
    websocket_frames      reads the frames, a bounded amount at a time
    websocket_leaving     what a peer still gets after the close
    transport             the interface between a connection and the server: messages in and out
    connection            a connection: reads messages, and performs what the state machine requests
    connection_writer     the writing half of a connection: messages, blocks when they are due, the close
    conversation          the state machine of a connection, without I/O and without a clock
    outgoing_blocks       the blocks of a connection: which is due, its messages, the last fade
    actions               what the state machine requests of the connection
    messages              the JSON Schemas of all messages, which are served
    message_checks        reads and checks what clients send, by these schemas
    server_messages       the text messages of the server
    contact_update        contact updates in binary and in JSON
    message_limits        how much a connection may send
    live_connections      the connections of a process: admission, sessions, checks by time
    live_stream           what outlives a connection: voice, newest update, recent PCM
    replay_buffer         the recent PCM, for a client that resumes
    silence_watchdog      lifts the finger when updates stop
    live_metrics          what a stream and its connection report to the metrics and the log
"""
