"""Campaigns: thousands of episodes described by one file, on one machine or a cluster."""
