"""`python -m impact` is `impact`."""

from .cli.main import main

main()
