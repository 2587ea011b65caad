"""Tasks: where a payload is to be brought, what stands in its way, and when it has arrived."""
