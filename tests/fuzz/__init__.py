"""Random campaigns against the project, as an adversary would run them: `python -m fuzz` (`make fuzz`)."""
