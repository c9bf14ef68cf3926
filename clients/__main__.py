"""`python -m clients`: the command line, from a checkout or wherever the script is not on the path."""

from clients.command_line import main

raise SystemExit(main())
