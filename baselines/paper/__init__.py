"""The paper as a test: its claims, the evidence for each, and the verdicts."""
