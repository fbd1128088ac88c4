"""`python -m farside`: the `farside` command."""

from farside.missions.commands.main import main

main()
