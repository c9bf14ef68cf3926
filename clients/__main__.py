"""`python -m clients`: the command line, where the script `ridgewave` is not on the path."""

from clients.command_line import main

raise SystemExit(main())
