"""Pictures of the crane."""
