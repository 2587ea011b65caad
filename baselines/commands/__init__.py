"""Commands: the programs of `oilcrane`, which are also those of `scripts/`."""
