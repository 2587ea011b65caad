"""The cockpit: one page on which a person drives the crane, and the processes behind it."""
