"""Command-line stories: evaluate, benchmark and what follows."""
