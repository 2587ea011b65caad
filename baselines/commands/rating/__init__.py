"""Commands that rate controllers: what can be reached, and who comes how near."""
