"""Classical anti-sway control: laws in closed form."""
