"""The line to a robot: protocol, transports, and the plant behind a serial port."""
