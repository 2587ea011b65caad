"""Support: what every room leans on and no crane is in."""
