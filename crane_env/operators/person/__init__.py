"""Person: an operator who looks at the payload, judges where it will rest, and presses."""
