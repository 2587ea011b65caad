"""The control process: the crane at 50 Hz, its controllers, and the dead-man over the buttons."""
