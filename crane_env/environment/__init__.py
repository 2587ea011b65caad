"""The Gymnasium faces of the crane: one, or many that step together."""
