"""Study: what controllers are worth to persons who bring payloads to their places."""
